#include "variolux/base/parallel.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

namespace vlx {

void parallelFor(std::int64_t begin, std::int64_t end, const std::function<void(std::int64_t)>& body) {
    tbb::parallel_for(begin, end, [&](std::int64_t i) { body(i); });
}

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
