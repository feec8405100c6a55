#pragma once

#include <cstdint>
#include <functional>
#include <memory>

namespace vlx {

/// Runs body(i) for every i in [begin, end) on oneTBB's threads, in any order; rethrows the first exception.
/// Results must not depend on that order: each task writes only what it owns.
void parallelFor(std::int64_t begin, std::int64_t end, const std::function<void(std::int64_t)>& body);

/// Ends the threads that parallelFor() works with, and waits for them; the next call starts others. At the
/// end of a program: nothing runs beside its last destructors.
void endThreads();

/// While it lives, at most `threads` threads work (0: all processors). Made once, in main.
class ThreadLimit {
  public:
    explicit ThreadLimit(int threads);
    ~ThreadLimit();

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Number of threads that parallelFor uses now.
int threadCount();

}  // namespace vlx
