#include "variolux/reconstruct/sequence.h"

#include <map>

#include "reconstruct/common/methods.h"
#include "reconstruct/drift/pipeline.h"
#include "reconstruct/sequence/merge.h"
#include "variolux/base/error.h"

namespace vlx {

namespace {

/// A frame with all that its samples say.
struct LoadedFrame {
    LoadedFrame(std::unique_ptr<SampleSource> dump, const Drift& options)
        : source(std::move(dump)),
          outline(driftOutline(*source, options)),
          clock(seconds),
          samples(*source, options, Kept::Whole, clock) {
        const int first = outline.data.y - source->header().data.y * options.scale;
        samples.own(first, first + outline.data.height);
        samples.frame().fillAll();
    }

    std::unique_ptr<SampleSource> source;
    Image outline;
    std::map<std::string, double> seconds;
    StageClock clock;
    SampledFrame samples;
};

}  // namespace

struct Sequence::Impl {
    Open open;
    Drift options;
    std::map<int, std::unique_ptr<LoadedFrame>> frames;  // null: there is no such frame

    LoadedFrame* load(int frame) {
        const auto [at, isNew] = frames.try_emplace(frame);
        if (isNew)
            if (std::unique_ptr<SampleSource> source = open(frame))
                at->second = std::make_unique<LoadedFrame>(std::move(source), options);
        return at->second.get();
    }
    /// Frames beside `frame`, the nearest first, up to one that is not there.
    std::vector<Neighbour> beside(int frame, int step) {
        std::vector<Neighbour> found;
        for (int k = 1; k <= options.temporal; ++k) {
            LoadedFrame* const there = load(frame + step * k);
            if (!there) break;
            found.push_back({&there->samples});
        }
        return found;
    }
};

Sequence::Sequence(Open open, const Drift& options) : impl_(new Impl{std::move(open), options, {}}) {}
Sequence::~Sequence() = default;

Image Sequence::outline(int frame) { return impl_->load(frame)->outline; }

ReconstructionReport Sequence::reconstruct(int frame, const RowSink& sink, const Progress& progress) {
    const int reach = impl_->options.temporal;
    std::erase_if(impl_->frames, [&](const auto& entry) {
        return entry.first < frame - reach || entry.first > frame + reach;
    });
    LoadedFrame& own = *impl_->load(frame);
    ReconstructionReport report;
    report.method.emplace<DriftReport>().seconds = own.seconds;
    StageClock clock(std::get<DriftReport>(report.method).seconds);
    Merge merge(own.samples, impl_->beside(frame, -1), impl_->beside(frame, 1));
    const Frame& plain = own.samples.frame();
    Frame merged(plain.layout(), plain.picture(), impl_->options, plain.width(), plain.height(), Kept::Rows,
                 merge, clock);
    FrameKriging(*own.source, impl_->options, merged, report, clock).run(sink, progress);
    return report;
}

}  // namespace vlx
