#include "variolux/base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace vlx {
namespace {

TEST(ParallelFor, VisitsEachIndexOnceForAnyNumberOfThreads) {
    for (int threads = 1; threads <= 8; ++threads) {
        const ThreadLimit limit(threads);
        std::vector<std::atomic<int>> visits(1000);
        parallelFor(0, 1000, [&](std::int64_t i) { ++visits[static_cast<std::size_t>(i)]; });
        for (const auto& count : visits) ASSERT_EQ(count, 1);
    }
}

TEST(ParallelFor, RethrowsAnException) {
    EXPECT_THROW(parallelFor(0, 100,
                             [](std::int64_t i) {
                                 if (i == 57) throw std::runtime_error("57");
                             }),
                 std::runtime_error);
}

TEST(ThreadLimit, IsSeenAndEnds) {
    const int before = threadCount();
    {
        const ThreadLimit limit(1);
        EXPECT_EQ(threadCount(), 1);
    }
    EXPECT_EQ(threadCount(), before);
}

}  // namespace
}  // namespace vlx
