#pragma once

#include <cstdint>
#include <functional>

#include "reconstruct/common/picture_scale.h"
#include "reconstruct/common/pixel_statistics.h"
#include "reconstruct/common/stage_clock.h"
#include "reconstruct/data/pixel_data.h"
#include "variolux/reconstruct/reconstruction.h"

/// What kriging needs of the picture at one resolution: drift.h, 1 and 2.
namespace vlx {

/// How many rows of a picture are kept.
enum class Kept {
    Rows,   ///< those that the stages after them look at
    Whole,  ///< all: other frames look at them too
};

/// Stages, each a ring of rows that is filled just ahead of what the next one needs: pixels, features,
/// variances.
class LevelData {
  public:
    /// What fills pixels() up to (not including) a row, which may lie below the picture.
    using Source = std::function<void(int until)>;

    /// `featureReach`: of prefilterFeatures(); `driven`: another level asks the source for rows as well, and
    /// earlier.
    LevelData(const SampleLayout& layout, bool unseen, int featureReach, int width, int height, Kept kept,
              bool driven, const PictureScale& picture, Source source, StageClock& clock);
    LevelData(const LevelData&) = delete;
    LevelData& operator=(const LevelData&) = delete;

    /// Lets this level's variances look at those of a level of half the resolution, which sees as far again.
    void lookAt(LevelData& wider) { wider_ = &wider; }
    /// Lets each stage start just far enough above row `first` of the variances for that row to be what it
    /// is in the whole picture. The first row of data that is needed.
    int startAbove(int first);
    /// Fills data, features and variances up to `until`.
    void fill(int until);

    /// Of all rows that are kept; none is taken yet when the level is made.
    std::uint64_t ringBytes() const;
    PixelRows& pixels() { return pixels_; }  ///< for the source to fill
    int width() const { return width_; }
    int height() const { return height_; }
    const PixelRows& pixels() const { return pixels_; }
    const RowRing& data() const { return pixels_.data; }     ///< DataPlanes
    const RowRing& features() const { return features_; }    ///< FeaturePlanes
    const RowRing& variances() const { return variances_; }  ///< VariancePlanes

  private:
    void prefilter(int until);

    const SampleLayout& layout_;
    bool unseen_;
    int featureReach_, width_, height_, radiance_;
    const PictureScale& picture_;
    Source source_;
    StageClock& clock_;
    PixelRows pixels_;
    RowRing features_, residuals_, variances_;
    LevelData* wider_ = nullptr;
    int prefilteredRows_ = 0, featureRows_ = 0, varianceRows_ = 0;
};

}  // namespace vlx
