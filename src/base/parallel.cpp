#include "variolux/base/parallel.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

#ifdef __SANITIZE_THREAD__
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>
#endif

#ifdef __SANITIZE_ADDRESS__
// Where AddressSanitizer sees memory of a thread's variables, it guesses its extent by the bytes before it,
// which glibc 2.36 does not set: LeakSanitizer then crashes ("Tracer caught signal 11"), whenever these look
// like a size.
extern "C" const char* __asan_default_options();  // NOLINT: the sanitizer's name
extern "C" const char* __asan_default_options() { return "intercept_tls_get_addr=0"; }
#endif

namespace vlx {

#ifdef __SANITIZE_THREAD__

// oneTBB is not compiled with the thread sanitizer, which cannot see what it orders and reports races where
// there are none. Under the sanitizer plain threads, which it understands, run the same bodies. The counter
// is relaxed: it must not order one body before another and so hide a race between them.
void parallelFor(std::int64_t begin, std::int64_t end, const std::function<void(std::int64_t)>& body) {
    std::atomic<std::int64_t> next = begin;
    std::exception_ptr error;
    std::mutex mutex;
    const auto work = [&] {
        std::int64_t i;
        while ((i = next.fetch_add(1, std::memory_order_relaxed)) < end) {
            try {
                body(i);
            } catch (...) {
                const std::lock_guard lock(mutex);
                if (!error) error = std::current_exception();
                next.store(end, std::memory_order_relaxed);
            }
        }
    };
    std::vector<std::jthread> threads;
    for (std::int64_t t = std::min<std::int64_t>(threadCount(), end - begin); t > 0; --t)
        threads.emplace_back(work);
    threads.clear();  // joins
    if (error) std::rethrow_exception(error);
}

void endThreads() {}

#else

void parallelFor(std::int64_t begin, std::int64_t end, const std::function<void(std::int64_t)>& body) {
    tbb::parallel_for(begin, end, [&](std::int64_t i) { body(i); });
}

void endThreads() {
    tbb::task_scheduler_handle threads{tbb::attach{}};
    static_cast<void>(tbb::finalize(threads, std::nothrow));  // others may still use them
}

#endif

struct ThreadLimit::Impl {
    tbb::global_control control;
};

ThreadLimit::ThreadLimit(int threads)
    : impl_(new Impl{
          tbb::global_control(tbb::global_control::max_allowed_parallelism,
                              threads > 0 ? static_cast<std::size_t>(threads)
                                          : static_cast<std::size_t>(tbb::info::default_concurrency()))}) {}

ThreadLimit::~ThreadLimit() = default;

int threadCount() {
    return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

}  // namespace vlx
