// Part of every test program whose code works on threads: they are ended before it ends, as tools do.
// LeakSanitizer crashes on threads that are just being started then.

#include <gtest/gtest.h>

#include "variolux/base/parallel.h"

namespace {

class EndThreads : public testing::Environment {
    void TearDown() override { vlx::endThreads(); }
};

[[maybe_unused]] const testing::Environment* const endThreads =
    testing::AddGlobalTestEnvironment(new EndThreads);

}  // namespace
