#pragma once

namespace vlx {

/// `vlx-compare sweep`: argv[0] is the word "sweep". Returns the exit code.
int sweepMain(int argc, char** argv);

}  // namespace vlx
