#include "variolux/reconstruct/sequence.h"

#include <map>
#include <optional>

#include "reconstruct/common/methods.h"
#include "reconstruct/drift/pipeline.h"
#include "variolux/base/error.h"

namespace vlx {

namespace {

/// A frame with all that its samples say.
struct LoadedFrame {
    LoadedFrame(std::unique_ptr<SampleSource> samples, const Drift& options)
        : source(std::move(samples)),
          outline(driftOutline(*source, options)),
          clock(seconds),
          frame(*source, options, Kept::Whole, clock) {
        const int first = outline.data.y - source->header().data.y * options.scale;
        frame.own(first, first + outline.data.height);
        frame.fillAll();
    }

    std::unique_ptr<SampleSource> source;
    Image outline;
    std::map<std::string, double> seconds;
    StageClock clock;
    Frame frame;
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
    std::vector<LoadedFrame*> beside(int frame, int step) {
        std::vector<LoadedFrame*> found;
        for (int k = 1; k <= options.temporal; ++k) {
            LoadedFrame* const there = load(frame + step * k);
            if (!there) break;
            found.push_back(there);
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
    const std::vector<LoadedFrame*> before = impl_->beside(frame, -1), after = impl_->beside(frame, 1);
    const auto at = [](const std::vector<LoadedFrame*>& list, bool coarse) {
        std::vector<Neighbour> of;
        for (const LoadedFrame* there : list)
            of.push_back({coarse ? &there->frame.coarse() : &there->frame.fine(), &there->frame.layout().scale});
        return of;
    };
    ReconstructionReport report;
    report.method.emplace<DriftReport>().seconds = own.seconds;
    StageClock clock(std::get<DriftReport>(report.method).seconds);
    Merge fine(own.frame.layout(), own.frame.fine(), at(before, false), at(after, false));
    std::optional<Merge> coarse;
    if (own.frame.halved()) coarse.emplace(own.frame.layout(), own.frame.coarse(), at(before, true), at(after, true));
    krigeFrame(*own.source, impl_->options, own.frame, {&fine, coarse ? &*coarse : nullptr}, report, clock, sink,
               progress);
    return report;
}

}  // namespace vlx
