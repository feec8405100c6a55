#pragma once

#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

namespace vlx {

/// Rows of several planes of floats, of which only the last `capacity` are kept: row y overwrites row
/// y - capacity. Rows are counted from 0; contiguous along x; zeros until written. Builds with assertions
/// notice who asks for a row that was overwritten: a capacity that is too small. Rows that are written in any
/// order, by several threads, are claimed first, so that this does not depend on the order.
class RowRing {
  public:
    RowRing() = default;
    RowRing(int width, int channels, int capacity)
        : width_(static_cast<std::size_t>(width)),
          channels_(channels),
          capacity_(capacity),
          // calloc: large blocks are only asked for here, and taken row by row as they are written.
          values_(static_cast<float*>(std::calloc(bytes() / sizeof(float), sizeof(float)))) {
        if (!values_ && bytes() > 0) throw std::bad_alloc();
#ifndef NDEBUG
        newest_ = std::make_unique<std::atomic<int>[]>(static_cast<std::size_t>(capacity));
#endif
    }

    int channels() const { return channels_; }
    std::size_t bytes() const {
        return width_ * static_cast<std::size_t>(channels_) * static_cast<std::size_t>(capacity_) *
               sizeof(float);
    }

    /// Rows from `first` up to (not including) `end` are about to be written: those in whose places they lie
    /// are gone, all at once.
    void claim([[maybe_unused]] int first, [[maybe_unused]] int end) {
#ifndef NDEBUG
        for (int y = first; y < end; ++y) assert(isKept(y));
        for (int y = first; y < end; ++y) assert(isKept(y));  // as well: no two share a place
#endif
    }

    float* row(int channel, int y) { return values_.get() + offset(channel, y); }
    const float* row(int channel, int y) const { return values_.get() + offset(channel, y); }

  private:
    std::size_t offset(int channel, int y) const {
        assert(y >= 0 && channel >= 0 && channel < channels_);
        assert(isKept(y));
        return (static_cast<std::size_t>(y % capacity_) * static_cast<std::size_t>(channels_) +
                static_cast<std::size_t>(channel)) *
               width_;
    }

#ifndef NDEBUG
    /// Whether no later row was asked for in y's place.
    bool isKept(int y) const {
        std::atomic<int>& newest = newest_[static_cast<std::size_t>(y % capacity_)];
        int before = newest.load(std::memory_order_relaxed);
        while (before < y && !newest.compare_exchange_weak(before, y, std::memory_order_relaxed)) {
        }
        return before <= y;
    }
    std::unique_ptr<std::atomic<int>[]> newest_;
#endif

    std::size_t width_ = 0;
    int channels_ = 0;
    int capacity_ = 1;
    struct Free {
        void operator()(float* values) const { std::free(values); }
    };
    std::unique_ptr<float[], Free> values_;
};

}  // namespace vlx
