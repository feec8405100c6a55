#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "combination.h"
#include "neighbourhoods.h"
#include "picture_scale.h"
#include "pixel_data.h"
#include "pixel_statistics.h"
#include "row_ring.h"
#include "stage_clock.h"

/// The picture at one resolution, from its data to the combination of its models: drift_kriging.h, 2 to 5.
namespace vlx {

/// Stages, each a ring of rows that is filled just ahead of what the next one needs.
class Level {
  public:
    /// What fills data(), squares() and raw() up to (not including) a row, which may lie below the picture.
    using Source = std::function<void(int until)>;

    /// `ahead`: rows that the source may fill beyond what this level asks for. The last model is the small
    /// one, which the first is shrunk towards.
    Level(const SampleLayout& layout, std::vector<NeighbourhoodModel> models, int width, int height,
          int ahead, const PictureScale& picture, Source source, ReconstructionReport& report,
          StageClock& clock);
    Level(const Level&) = delete;
    Level& operator=(const Level&) = delete;

    /// Lets each stage start just far enough above row `first` of combined() for that row to be what it is in
    /// the whole picture. The first row of data that is needed.
    int startAbove(int first);
    /// Fills combined() up to `until`.
    void combine(int until);

    /// Of all rows that are kept; none is taken yet when the level is made.
    std::uint64_t ringBytes() const;
    int width() const { return width_; }
    int height() const { return height_; }
    int radiance() const { return radiance_; }
    int featureCount() const { return layout_.features; }

    RowRing& data() { return data_; }        ///< pixel_data.h
    RowRing& squares() { return squares_; }  ///< kSquaresPlanes
    RowRing& raw() { return raw_; }          ///< f features, then the error variances of their means
    const RowRing& data() const { return data_; }
    const RowRing& squares() const { return squares_; }
    const RowRing& raw() const { return raw_; }
    const RowRing& features() const { return features_; }    ///< prefilter.h
    const RowRing& variances() const { return variances_; }  ///< of one sample of R, G, B
    const RowRing& combined() const { return combined_; }    ///< CombinedPlanes

  private:
    int kept(int rows) const { return std::min(rows, height_); }
    void prefilter(int until);
    void smooth(int until);
    void krige(int until);
    void finish(int until);
    void finishRow(std::size_t m, int y);
    void shrinkRow(int y);

    const SampleLayout& layout_;
    std::vector<NeighbourhoodModel> models_;
    int width_, height_, radiance_;
    const PictureScale& picture_;
    Source source_;
    ReconstructionReport& report_;
    StageClock& clock_;
    RowRing data_, squares_, raw_, features_, variances_;
    std::vector<RowRing> sums_, estimates_;  // of each model; estimates_: ModelPlanes
    RowRing moments_, combined_;
    Combination combination_;
    int featureRows_ = 0, varianceRows_ = 0, krigedRows_ = 0, zeroedRows_ = 0, finishedRows_ = 0,
        combinedRows_ = 0;
};

}  // namespace vlx
