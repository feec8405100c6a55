#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "reconstruct/common/picture_scale.h"
#include "reconstruct/common/pixel_statistics.h"
#include "reconstruct/common/stage_clock.h"
#include "reconstruct/drift/combination.h"
#include "reconstruct/drift/neighbourhoods.h"
#include "reconstruct/drift/pixel_data.h"
#include "variolux/reconstruct/reconstruction.h"

/// The picture at one resolution, from its data to the combination of its models: drift.h, 2 to 5.
namespace vlx {

/// What a level holds when it is combined.
struct LevelRows {
    int width, height;
    const RowRing& data;       ///< DataPlanes
    const RowRing& features;   ///< FeaturePlanes
    const RowRing& variances;  ///< VariancePlanes
    const RowRing& combined;   ///< CombinedPlanes
};

/// What a quality asks of a level.
struct LevelPlan {
    std::vector<NeighbourhoodModel> models;
    int featureReach;  ///< of prefilterFeatures()
};

/// `coarse`: of half the resolution.
LevelPlan planOf(Quality quality, bool coarse);

/// Stages, each a ring of rows that is filled just ahead of what the next one needs.
class Level {
  public:
    /// What fills pixels() up to (not including) a row, which may lie below the picture.
    using Source = std::function<void(int until)>;

    /// `driven`: another level asks the source for rows as well, and earlier.
    Level(const SampleLayout& layout, const DriftSteps& steps, const LevelPlan& plan, int width, int height,
          bool driven, const PictureScale& picture, Source source, DriftReport& report, StageClock& clock);
    Level(const Level&) = delete;
    Level& operator=(const Level&) = delete;

    /// Lets this level's variances look at those of a level of half the resolution, which sees as far again.
    void lookAt(Level& wider) { wider_ = &wider; }
    /// Lets each stage start just far enough above row `first` of the combination for that row to be what it
    /// is in the whole picture. The first row of data that is needed.
    int startAbove(int first);
    /// Fills the combination up to `until`.
    void combine(int until);

    /// Of all rows that are kept; none is taken yet when the level is made.
    std::uint64_t ringBytes() const;
    PixelRows& pixels() { return pixels_; }  ///< for the source to fill
    LevelRows rows() const { return {width_, height_, pixels_.data, features_, variances_, combined_}; }

  private:
    int kept(int rows) const { return std::min(rows, height_); }
    void prefilter(int until);
    void smooth(int until);
    void krige(int until);
    void finish();
    void finishRow(std::size_t m, int y);
    void fillGaps(int y);

    const SampleLayout& layout_;
    DriftSteps steps_;
    int featureReach_;
    std::vector<NeighbourhoodModel> models_;
    int width_, height_, radiance_;
    const PictureScale& picture_;
    Source source_;
    DriftReport& report_;
    StageClock& clock_;
    PixelRows pixels_;
    RowRing features_, residuals_, variances_;
    std::vector<RowRing> sums_, estimates_;  // of each model; estimates_: ModelPlanes
    RowRing moments_, combined_;
    Combination combination_;
    Level* wider_ = nullptr;
    int prefilteredRows_ = 0, featureRows_ = 0, varianceRows_ = 0, krigedRows_ = 0, zeroedRows_ = 0,
        finishedRows_ = 0, combinedRows_ = 0;
};

}  // namespace vlx
