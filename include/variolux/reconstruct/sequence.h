#pragma once

#include <functional>
#include <memory>

#include "variolux/reconstruct/reconstruct.h"

/// Frames of a sequence, kriged with data of the frames around them: drift.h, 10.
namespace vlx {

/// How many frames before `frame`, and how many after it, add to it.
struct FramesAround {
    int before = 0, after = 0;
};
/// Of a window of 2 `temporal` + 1 frames: as many on either side, or, near the first or the last frame of a
/// shot, so many more on the other; up to the first that is not there. No frame is below 0.
FramesAround framesAround(int frame, int temporal, const std::function<bool(int)>& exists);

/// Holds what the samples of a window of frames say, each whole: about 60 floats a pixel of each with albedo,
/// normal and depth (1920 x 1080 pixels: 0.5 GB).
class Sequence {
  public:
    /// The samples of a frame; null where there is no such frame. May throw Error.
    using Open = std::function<std::unique_ptr<SampleSource>(int frame)>;

    /// framesAround() of Drift::temporal add to each frame.
    Sequence(Open open, const Drift& options);
    ~Sequence();
    Sequence(const Sequence&) = delete;
    Sequence& operator=(const Sequence&) = delete;

    /// As reconstruct() of that frame: the same pixels whatever frames were asked for before. Where they are
    /// asked for in order each is read once. Throws Error as it, where there is no such frame, and where one
    /// of those around is of another size or has other channels.
    ReconstructionReport reconstruct(int frame, const RowSink& sink, const Progress& progress = {});
    Reconstruction reconstruct(int frame, const Progress& progress = {});

    /// Has the frame read anew: it is another one now.
    void forget(int frame);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace vlx
