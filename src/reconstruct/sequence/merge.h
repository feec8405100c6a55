#pragma once

#include <vector>

#include "reconstruct/data/level_data.h"

/// Data of neighbouring frames, brought to a frame by motion and joined to its own.
namespace vlx {

/// A frame near the one that is kriged, at one resolution.
struct Neighbour {
    const LevelData* data;
    const std::vector<float>* scale;  ///< SampleLayout's, of its features
};

/// What a frame's pixels are with the data of its neighbours, a ring of rows each: means and counts of the
/// halves (the first planes of DataPlanes), and features (FeaturePlanes).
struct MergedRows {
    RowRing data, features;
};

/// Refers to its frames, which are filled.
class Merge {
  public:
    /// `before`: the frames 1, 2, ... before this one; `after` likewise. Of the same size as it.
    Merge(const SampleLayout& layout, const LevelData& own, std::vector<Neighbour> before,
          std::vector<Neighbour> after);

    /// Fills merged rows up to `until`, from row `first` of the first call on.
    void startAbove(int first);
    void fill(int until);
    const MergedRows& rows() const { return merged_; }
    std::uint64_t ringBytes() const { return apart_.bytes() + merged_.data.bytes() + merged_.features.bytes(); }

  private:
    std::size_t neighbours() const { return before_.size() + after_.size(); }
    const Neighbour& neighbour(std::size_t k) const {
        return k < before_.size() ? before_[k] : after_[k - before_.size()];
    }
    void compareRow(int y);
    void mergeRow(int y);

    const SampleLayout& layout_;
    DataPlanes planes_;
    FeaturePlanes featurePlanes_;
    const LevelData& own_;
    std::vector<Neighbour> before_, after_;
    int width_, height_;
    RowRing apart_;  // ApartPlanes of each neighbour
    MergedRows merged_;
    int comparedRows_ = 0, mergedRows_ = 0;
};

}  // namespace vlx
