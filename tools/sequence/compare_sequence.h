#pragma once

namespace vlx {

/// `vlx-compare sequence`: argv[0] is the word "sequence". Returns the exit code.
int sequenceMain(int argc, char** argv);

}  // namespace vlx
