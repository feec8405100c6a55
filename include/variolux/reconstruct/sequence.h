#pragma once

#include <functional>
#include <memory>

#include "variolux/reconstruct/reconstruct.h"

/// Frames of a sequence, kriged with data of the frames around them.
namespace vlx {

class Sequence {
  public:
    /// The samples of a frame; null where there is no such frame.
    using Open = std::function<std::unique_ptr<SampleSource>(int frame)>;

    /// Drift::temporal frames before and after a frame, as far as there are some, add to it.
    Sequence(Open open, const Drift& options);
    ~Sequence();
    Sequence(const Sequence&) = delete;
    Sequence& operator=(const Sequence&) = delete;

    /// The picture of a frame without its pixels, as outline().
    Image outline(int frame);
    /// Each frame is read once where frames follow each other; the same pixels in any order.
    ReconstructionReport reconstruct(int frame, const RowSink& sink, const Progress& progress = {});

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace vlx
