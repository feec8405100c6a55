#pragma once

#include "reconstruct/data/frame.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {

/// Kriges a frame that shows what `dump` does, and gives the rows of the picture to `sink`. The clock is that
/// of the frame, and adds to the DriftReport of `report`.
class FrameKriging {
  public:
    FrameKriging(const SampleSource& dump, const Drift& options, Frame& frame, ReconstructionReport& report,
                 StageClock& clock);
    ~FrameKriging();
    FrameKriging(const FrameKriging&) = delete;
    FrameKriging& operator=(const FrameKriging&) = delete;

    /// Of all rows that are kept; none is taken yet when it is made.
    std::uint64_t ringBytes() const;
    void run(const RowSink& sink, const Progress& progress);

  private:
    class Stages;
    std::unique_ptr<Stages> stages_;
};

/// What a process holds besides rows of pictures: libraries, what is resident already, threads' tiles.
std::uint64_t bytesBesideRows();

}  // namespace vlx
