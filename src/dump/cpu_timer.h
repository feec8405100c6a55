#pragma once

#include <time.h>

#include <atomic>
#include <cstdint>

namespace vlx {

/// Adds the processor time of its own life, in nanoseconds, to a sum.
class CpuTimer {
  public:
    explicit CpuTimer(std::atomic<std::int64_t>& sum) : sum_(sum) {}
    ~CpuTimer() { sum_ += now() - start_; }
    CpuTimer(const CpuTimer&) = delete;
    CpuTimer& operator=(const CpuTimer&) = delete;

  private:
    static std::int64_t now() {
        timespec time{};
        ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
        return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
    }
    std::atomic<std::int64_t>& sum_;
    const std::int64_t start_ = now();
};

}  // namespace vlx
