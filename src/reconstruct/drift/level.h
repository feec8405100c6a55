#pragma once

#include <cstdint>
#include <vector>

#include "reconstruct/common/pixel_statistics.h"
#include "reconstruct/common/stage_clock.h"
#include "reconstruct/data/level_data.h"
#include "reconstruct/drift/combination.h"
#include "reconstruct/drift/neighbourhoods.h"
#include "variolux/reconstruct/reconstruction.h"

/// The picture at one resolution, from its data to the combination of its models: drift.h, 3 to 5.
namespace vlx {

/// What a level holds when it is combined.
struct LevelRows {
    int width, height;
    const RowRing& data;       ///< DataPlanes
    const RowRing& features;   ///< FeaturePlanes
    const RowRing& variances;  ///< VariancePlanes
    const RowRing& combined;   ///< CombinedPlanes
};

/// The models of a quality; `coarse`: of half the resolution.
std::vector<NeighbourhoodModel> modelsOf(Quality quality, bool coarse);

/// Stages, each a ring of rows that is filled just ahead of what the next one needs.
class Level {
  public:
    /// Kriges `data` by the models that the options ask for.
    Level(const SampleLayout& layout, const Drift& options, bool coarse, LevelData& data, DriftReport& report,
          StageClock& clock);
    Level(const Level&) = delete;
    Level& operator=(const Level&) = delete;

    /// Lets each stage start just far enough above row `first` of the combination for that row to be what it
    /// is in the whole picture. The first row of variances that is needed.
    int startAbove(int first);
    /// Fills the combination up to `until`.
    void combine(int until);

    /// Of all rows that are kept; none is taken yet when the level is made.
    std::uint64_t ringBytes() const;
    LevelRows rows() const {
        return {width_, height_, data_.data(), data_.features(), data_.variances(), combined_};
    }

  private:
    int kept(int rows) const { return std::min(rows, height_); }
    void krige(int until);
    void finish();
    void finishRow(std::size_t m, int y);
    void fillGaps(int y);

    const SampleLayout& layout_;
    DriftSteps steps_;
    std::vector<NeighbourhoodModel> models_;
    LevelData& data_;
    int width_, height_, radiance_;
    DriftReport& report_;
    StageClock& clock_;
    std::vector<RowRing> sums_, estimates_;  // of each model; estimates_: ModelPlanes
    RowRing moments_, combined_;
    Combination combination_;
    int krigedRows_ = 0, zeroedRows_ = 0, finishedRows_ = 0, combinedRows_ = 0;
};

}  // namespace vlx
