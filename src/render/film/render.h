#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "render/film/append.h"
#include "render/film/region_sampling.h"
#include "render/film/sample_map.h"
#include "render/integrator/integrator.h"
#include "render/plan/plan.h"
#include "render/scene/scene.h"
#include "variolux/base/progress.h"
#include "variolux/base/window.h"
#include "variolux/dump/format.h"

namespace vlx::render {

struct RenderOptions {
    int width = 512;  ///< of the whole picture, in pixels
    int height = 512;
    std::optional<Window> crop;  ///< the part to render; inside the picture
    Band band;                   ///< only these rows of that: the samples that the whole has there
    std::size_t camera = 0;      ///< index into the scene's cameras
    int spp = 16;                ///< samples in each pixel, when uniform
    int replicates = 1;          ///< independent randomisations that share spp; > 1 adds sample.replicate
    bool hierarchical = false;   ///< METHOD.md, section 3: 1 to 256 samples a pixel as needed
    HierarchicalOptions refinement;
    std::uint64_t seed = 0;
    const SampleMap* map = nullptr;        ///< where the samples are wanted; spp is then their mean
    const EarlierDump* earlier = nullptr;  ///< whose samples are to be kept, before the new ones
    PathOptions path;
    IntegratorKind integrator = IntegratorKind::Path;
    std::string integratorReason;  ///< for the header, when not empty
    DumpCompression compression = DumpCompression::Rle;
    std::string version;       ///< of the program, for the header
    std::string inputs;        ///< for the header's kInputsAttribute (base/fingerprint.h)
    std::string picture;       ///< for its kPictureAttribute (append.h)
    std::optional<Plan> plan;  ///< set by follow()

    /// Adopts a plan, which applyPlan is to apply to the scene too.
    void follow(const Plan& adopted);

    /// Bidirectional: in how many replicates light subpaths are kept apart: `replicates` or, when that is 1,
    /// the greatest divisor of spp that is at most 64 and keeps their images within 2 GiB. 0: none does.
    int splatReplicates() const;

    /// The broken constraint in words, or nothing.
    std::optional<std::string> validate(const Scene& scene) const;
};

struct RenderReport {
    std::uint64_t samples = 0;
    std::uint64_t nonFinite = 0;  ///< samples (and splats) whose radiance overflowed: written as 0
    double meanLuminance = 0;     ///< of the pixels that were traced, by the new samples (Rec. 709)
    double traceSeconds = 0;      ///< wall time of tracing
    double traceCpuSeconds = 0;   ///< processor time of the process, writing taken off
    double writeCpuSeconds = 0;   ///< processor time of compressing and writing
    std::vector<std::uint64_t> refinedCells;  ///< hierarchical: cells refined at each level
};

/// Renders a scene into a dump. Works in bands of at most 16 rows: one is traced while the ones before are
/// written, and memory does not grow with the picture's height, but for splats: bidirectional tracing keeps
/// 12 bytes a pixel and replicate. A sample depends on (seed, pixel, index) only: the file is the same, byte
/// for byte, for any number of threads, and bands merge into the whole's file. What is sampled
/// hierarchically is sampled by whole regions of 4 x 4 pixels: those that a band's border cuts are traced,
/// and their refined cells counted, for both bands. Throws Error when there are more bands than rows and
/// when the file cannot be written.
RenderReport renderDump(const Scene& scene, const Accelerator& accelerator, const std::string& path,
                        const RenderOptions& options, const Progress& progress = {});

}  // namespace vlx::render
