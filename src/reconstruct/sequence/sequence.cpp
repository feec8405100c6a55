#include "variolux/reconstruct/sequence.h"

#include <map>
#include <string>

#include "reconstruct/common/methods.h"
#include "reconstruct/common/relative_error.h"
#include "reconstruct/drift/pipeline.h"
#include "reconstruct/sequence/merge.h"
#include "variolux/base/error.h"
#include "variolux/base/memory.h"

namespace vlx {

namespace {

/// A frame with all that its samples say.
struct LoadedFrame {
    LoadedFrame(std::unique_ptr<SampleSource> dump, const Drift& options, std::uint64_t held)
        : source(std::move(dump)),
          outline(driftOutline(*source, options)),
          clock(seconds),
          samples(*source, options, Kept::Whole, clock) {
        const int first = outline.data.y - source->header().data.y * options.scale;
        samples.own(first, first + outline.data.height);
        requireFrames(options, held);
        samples.frame().fillAll();
        samples.frame().counts().range.require(source->path(), "of the picture");
    }

    /// That as many as are held at a time fit into memory, with the stages of one that is kriged and the
    /// frame that they are merged into; what of the limit is left is for reading this one.
    void requireFrames(const Drift& options, std::uint64_t held) {
        const auto frames = static_cast<std::uint64_t>(2 * options.temporal + 1);
        const std::string what =
            std::to_string(frames) + " frames of this size (--temporal with a smaller number takes less)";
        ReconstructionReport report;
        report.method.emplace<DriftReport>();
        const std::uint64_t rows =
            FrameKriging(*source, options, samples.frame(), report, clock).ringBytes() +
            frames * samples.frame().ringBytes();
        requireMemory(source->path(), rows, what);
        if (options.maxMemory == 0) return;
        // What frames before it hold is in `rows` and resident.
        const std::uint64_t bytes = rows + bytesBesideRows() - std::min(held, rows);
        if (bytes > options.maxMemory)
            throw Error(source->path(), "expected a memory limit of at least " + memoryLimitFor(bytes) +
                                            " for " + what + ", found " +
                                            std::to_string(options.maxMemory / 1'000'000) + "M");
        samples.readWithin(options.maxMemory, bytes);
    }

    std::unique_ptr<SampleSource> source;
    Image outline;
    std::map<std::string, double> seconds;
    bool timed = false;  ///< its time is in a frame's report
    StageClock clock;
    SampledFrame samples;
};

bool sameSeed(const LoadedFrame& a, const LoadedFrame& b) {
    const auto &x = a.source->header().seed, &y = b.source->header().seed;
    return x && y && *x == *y;
}

/// Throws Error unless `there` shows as much as `own`, in the same way.
void requireAlike(const LoadedFrame& there, const LoadedFrame& own) {
    const Window &a = there.source->header().data, &b = own.source->header().data;
    const std::string help = ", as " + own.source->path() + " has: --temporal 0 kriges each frame by itself";
    if (a != b)
        throw Error(there.source->path(), "expected " + windowText(b) + ", found " + windowText(a) + help);
    const SampleLayout &x = there.samples.frame().layout(), &y = own.samples.frame().layout();
    if (x.radiance != y.radiance || x.features != y.features || x.alpha != y.alpha || x.group != y.group)
        throw Error(there.source->path(), "expected " + std::to_string(y.radiance) +
                                              " channels of radiance and " + std::to_string(y.features) +
                                              " features, found " + std::to_string(x.radiance) + " and " +
                                              std::to_string(x.features) + help);
}

}  // namespace

struct Sequence::Impl {
    Open open;
    Drift options;
    std::map<int, std::unique_ptr<LoadedFrame>> frames;  // null: there is no such frame

    std::map<int, std::unique_ptr<SampleSource>> opened;  // those of them that are not loaded yet

    bool exists(int frame) {
        const auto found = frames.find(frame);
        if (found != frames.end()) return found->second != nullptr;
        std::unique_ptr<SampleSource>& source = opened[frame];
        if (!source) source = open(frame);
        return source != nullptr;
    }
    std::uint64_t heldBytes() const {
        std::uint64_t bytes = 0;
        for (const auto& [number, frame] : frames)
            if (frame) bytes += frame->samples.frame().ringBytes();
        return bytes;
    }
    LoadedFrame* load(int frame) {
        const auto found = frames.find(frame);
        if (found != frames.end()) return found->second.get();
        std::unique_ptr<LoadedFrame> loaded;
        if (exists(frame))
            loaded = std::make_unique<LoadedFrame>(std::move(opened[frame]), options, heldBytes());
        opened.erase(frame);
        return (frames[frame] = std::move(loaded)).get();
    }
    /// The `count` frames beside `frame`, the nearest first.
    std::vector<Neighbour> beside(int frame, int step, int count) {
        std::vector<Neighbour> found;
        const LoadedFrame& own = *load(frame);
        for (int k = 1; k <= count; ++k) {
            LoadedFrame* const there = load(frame + step * k);
            requireAlike(*there, own);
            there->timed = true;
            found.push_back({&there->samples, sameSeed(*there, own)});
        }
        return found;
    }
};

FramesAround framesAround(int frame, int temporal, const std::function<bool(int)>& exists) {
    FramesAround around;
    const auto extend = [&](int& count, int step, int most) {
        while (count < most && frame + step * (count + 1) >= 0 && exists(frame + step * (count + 1))) ++count;
    };
    extend(around.before, -1, temporal);
    extend(around.after, 1, 2 * temporal - around.before);
    extend(around.before, -1, 2 * temporal - around.after);
    return around;
}

Sequence::Sequence(Open open, const Drift& options) : impl_(new Impl{std::move(open), options, {}, {}}) {}
Sequence::~Sequence() = default;

void Sequence::forget(int frame) {
    impl_->frames.erase(frame);
    impl_->opened.erase(frame);
}

ReconstructionReport Sequence::reconstruct(int frame, const RowSink& sink, const Progress& progress) {
    const auto around = framesAround(frame, impl_->options.temporal, [&](int i) { return impl_->exists(i); });
    const int first = frame - around.before, last = frame + around.after;
    std::erase_if(impl_->frames, [&](const auto& entry) {
        return entry.first < first || entry.first > last || !entry.second;
    });
    std::erase_if(impl_->opened,
                  [&](const auto& entry) { return entry.first < first || entry.first > last; });
    LoadedFrame* const own = impl_->load(frame);
    if (!own) throw Error("", "expected frame " + std::to_string(frame) + " of the sequence, found none");
    ReconstructionReport report;
    DriftReport& drift = report.method.emplace<DriftReport>();
    if (!own->timed) drift.seconds = own->seconds;
    own->timed = true;
    StageClock clock(drift.seconds);
    const std::vector<Neighbour> before = impl_->beside(frame, -1, around.before),
                                 after = impl_->beside(frame, 1, around.after);
    clock.addTo("other frames");
    Merge merge(own->samples, before, after);
    const Frame& plain = own->samples.frame();
    Frame merged(plain.layout(), plain.picture(), impl_->options, plain.width(), plain.height(), Kept::Rows,
                 merge, clock);
    MeasuredRows measured(own->outline, sink);
    FrameKriging(*own->source, impl_->options, merged, report, clock).run(measured.sink(), progress);
    report.predictedRelMse = measured.relMse();
    SequenceReport& of = drift.sequence.emplace();
    of.wanted = 2 * impl_->options.temporal;
    of.gain = merge.gain();
    of.withoutMotion = own->samples.motion().channels() == 0;
    for (const auto* list : {&before, &after})
        for (const Neighbour& neighbour : *list) {
            ++of.frames;
            of.equalSeeds += neighbour.sameSeed;
            of.withoutMotion += neighbour.frame->motion().channels() == 0;
        }
    return report;
}

Reconstruction Sequence::reconstruct(int frame, const Progress& progress) {
    const LoadedFrame* const own = impl_->load(frame);
    if (!own) throw Error("", "expected frame " + std::to_string(frame) + " of the sequence, found none");
    return wholeOf(*own->source, own->outline,
                   [&](const RowSink& keep) { return reconstruct(frame, keep, progress); });
}

}  // namespace vlx
