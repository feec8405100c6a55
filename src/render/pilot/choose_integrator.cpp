#include "render/pilot/choose_integrator.h"

#include <array>
#include <cmath>

#include "variolux/base/hash.h"
#include "variolux/base/text.h"

namespace vlx::render {
namespace {

constexpr int kLongerSide = 24;  ///< of the pilot's picture at most
constexpr int kRounds = 16;
/// Samples of the picture from which on a pilot, about 0.4 s, is worth it.
constexpr double kLeastSamples = 2e5;
/// Time of a bidirectional tracer's ray, scattering included, over that of a path tracer's.
constexpr double kRayCost = 1.25;
/// How many times as fast bidirectional tracing must be: pilots err, and kriging gains from more samples.
constexpr double kMargin = 2;

/// The picture, or its crop, with few pixels.
struct SmallPicture {
    explicit SmallPicture(const RenderOptions& options) {
        const Window whole{0, 0, options.width, options.height};
        const Window part = options.crop.value_or(whole);
        const double scale =
            std::min(1.0, static_cast<double>(kLongerSide) / std::max(part.width, part.height));
        const auto scaled = [scale](int v) { return static_cast<int>(std::lround(v * scale)); };
        width = std::max(1, scaled(options.width));
        height = std::max(1, scaled(options.height));
        window.x = std::min(scaled(part.x), width - 1);
        window.y = std::min(scaled(part.y), height - 1);
        window.width = std::clamp(scaled(part.width), 1, width - window.x);
        window.height = std::clamp(scaled(part.height), 1, height - window.y);
    }
    int width = 1, height = 1;
    Window window;
};

/// Pilots of one integrator: a picture a round, pixel by pixel, channel by channel.
struct Pilot {
    std::array<std::vector<double>, kRounds> rounds;
    std::vector<double> pathSquares;  ///< bidirectional: second moment of path tracing, a round's mean
    double rays = 0;

    double sum() const {
        double all = 0;
        for (const auto& round : rounds)
            for (const double v : round) all += v;
        return all;
    }
};

class Pilots {
  public:
    Pilots(const Scene& scene, const Accelerator& accelerator, const RenderOptions& options)
        : scene_(scene),
          accelerator_(accelerator),
          options_(options),
          picture_(options),
          view_(scene.cameras[options.camera], picture_.width, picture_.height) {}

    Pilot path(int maxBounces, int rounds) const {
        PathOptions path = options_.path;
        path.maxBounces = std::min(path.maxBounces, maxBounces);
        return run(IntegratorKind::Path, path, rounds);
    }

    Pilot bidirectional() const { return run(IntegratorKind::Bidirectional, options_.path, kRounds); }

  private:
    Pilot run(IntegratorKind kind, const PathOptions& path, int rounds) const {
        const Window& window = picture_.window;
        const std::unique_ptr<Integrator> integrator =
            makeIntegrator(kind, scene_, accelerator_, view_, window, path);
        const auto pixels = static_cast<std::size_t>(window.pixels());
        Pilot pilot;
        pilot.pathSquares.assign(3 * pixels, 0.0);
        std::vector<Splat> splats;
        const std::uint64_t before = accelerator_.raysOnThisThread();
        for (int round = 0; round < rounds; ++round) {
            std::vector<double>& sums = pilot.rounds[static_cast<std::size_t>(round)];
            sums.assign(3 * pixels, 0.0);
            const auto add = [&](std::vector<double>& to, int column, int row, const Rgb& v, double scale) {
                if (!isFinite(v)) return;
                const auto at =
                    3 * static_cast<std::size_t>((row - window.y) * window.width + column - window.x);
                to[at] += v.x * scale;
                to[at + 1] += v.y * scale;
                to[at + 2] += v.z * scale;
            };
            for (int row = window.y; row < window.y + window.height; ++row)
                for (int column = window.x; column < window.x + window.width; ++column) {
                    const CameraSample sample =
                        sampleInPixel(column, row, hashOf(options_.seed, 0x696e74u, round, column, row), 0);
                    Rgb squares;
                    add(sums, column, row, integrator->trace(sample, splats, &squares).radiance, 1);
                    add(pilot.pathSquares, column, row, squares, 1.0 / kRounds);
                    for (const Splat& s : splats) {
                        const Rgb v = s.radiance / static_cast<float>(pixels);
                        add(sums, static_cast<int>(s.x), static_cast<int>(s.y), v, 1);
                        add(pilot.pathSquares, static_cast<int>(s.x), static_cast<int>(s.y), v * v * s.spread,
                            1.0 / kRounds);
                    }
                    splats.clear();
                }
        }
        pilot.rays = static_cast<double>(accelerator_.raysOnThisThread() - before);
        return pilot;
    }

    const Scene& scene_;
    const Accelerator& accelerator_;
    const RenderOptions& options_;
    SmallPicture picture_;
    View view_;
};

/// Mean and variance of a round, of each pixel and channel.
struct Statistics {
    explicit Statistics(const Pilot& pilot) : mean(pilot.rounds[0].size()), variance(mean.size()) {
        for (std::size_t i = 0; i < mean.size(); ++i) {
            double squares = 0;
            for (const auto& round : pilot.rounds) {
                mean[i] += round[i] / kRounds;
                squares += round[i] * round[i] / kRounds;
            }
            variance[i] = std::max(0.0, squares - mean[i] * mean[i]) * kRounds / (kRounds - 1);
        }
    }
    std::vector<double> mean, variance;
};

/// Mean relative variances of one round of both integrators, as relMSE weighs errors.
struct Errors {
    Errors(const Statistics& a, const Statistics& b, const std::vector<double>& pathSquares) {
        double known = 0;
        const std::size_t n = a.mean.size();
        for (std::size_t i = 0; i < n; ++i) {
            const double mean = 0.5 * (a.mean[i] + b.mean[i]);
            const double scale = 1 / ((mean * mean + 0.01) * static_cast<double>(n));
            path += a.variance[i] * scale;
            both += b.variance[i] * scale;
            known += (pathSquares[i] - b.mean[i] * b.mean[i]) * scale;
        }
        // What path tracing has not met in the pilot does not show in its own variance.
        path = std::max(path, known);
    }
    double path = 0;
    double both = 0;
};

}  // namespace

IntegratorChoice chooseIntegrator(const Scene& scene, const Accelerator& accelerator,
                                  const RenderOptions& options, double samples) {
    RenderOptions other = options;
    other.integrator = IntegratorKind::Bidirectional;
    other.band = {};  // as for the whole picture, which bands must agree with
    if (const auto fault = other.validate(scene)) return {IntegratorKind::Path, *fault, false};
    if (scene.lights.empty()) return {IntegratorKind::Path, "there are no lights to start from", false};
    const EffectSet& called = options.plan->called;
    if (!called.has(Effect::Indirect) || !options.path.effects.has(Effect::Indirect) ||
        options.path.maxBounces < 2)
        return {IntegratorKind::Path, "light scatters once at most", false};
    if (samples < kLeastSamples) return {IntegratorKind::Path, "too few samples for a pilot to pay", false};

    const Pilots pilots(scene, accelerator, options);
    std::string why = "caustics";
    if (!called.has(Effect::Caustics)) {
        constexpr int kFew = 4;
        const double all = pilots.path(options.path.maxBounces, kFew).sum();
        const double straight = pilots.path(1, kFew).sum();
        const double share = all > 0 ? straight / all : 1;
        if (share >= 0.25)
            return {IntegratorKind::Path,
                    "no caustics, and " + formatted("%.0f", 100 * share) + " % of the light comes straight",
                    false};
        why = "only " + formatted("%.0f", 100 * share) + " % of the light comes straight";
    }
    const Pilot path = pilots.path(options.path.maxBounces, kRounds);
    const Pilot both = pilots.bidirectional();
    const Errors errors{Statistics(path), Statistics(both), both.pathSquares};
    const double pathCost = errors.path * path.rays;
    const double bothCost = errors.both * both.rays * kRayCost;
    const bool better = bothCost * kMargin < pathCost;
    const double ratio = bothCost > 0 ? pathCost / bothCost : 1;
    return {better ? IntegratorKind::Bidirectional : IntegratorKind::Path,
            why + "; in a pilot bidirectional tracing was " + formatted("%.2g", ratio) +
                " times as fast to an error",
            true};
}

}  // namespace vlx::render
