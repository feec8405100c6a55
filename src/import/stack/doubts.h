#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "import/stack/plan.h"
#include "variolux/dump/band.h"

/// What may be wrong with the images of a stack, found while they are read. All look at bands that have a
/// sample of each of `images` images in each pixel.
namespace vlx {

/// Whether the images see the same places: renderers that put a sample at the pixel's centre, whatever the
/// seed, give images whose features (albedo, normal, depth) agree bit for bit.
///
/// Only pixels where a feature varies can tell: those whose features differ from both neighbours' in the row,
/// in the first image. A wall seen from the front, or its straight edges, say nothing. Where features vary
/// over a pixel, samples that are spread over it disagree; at half precision, or at edges, two of them may
/// agree by chance, in at most two pixels of three. 3 of 4 is the limit, of at least 100 pixels.
class FeatureAgreement {
  public:
    FeatureAgreement(const SampleBand& band, std::size_t images);
    void add(const SampleBand& band);
    std::vector<std::string> notes(bool cycles) const;

  private:
    std::vector<std::size_t> channels_;
    std::size_t images_;
    std::int64_t telling_ = 0, agreeing_ = 0;
};

/// Light beyond what half floats hold: 65504 or infinity in radiance that is stored so.
class HalfLimit {
  public:
    HalfLimit(FlatImages& images, const StackPlan& plan);
    bool anyHalf() const { return !channels_.empty(); }
    /// Of the rows read last.
    void add(const FlatImages& images, std::size_t pixels);
    std::vector<std::string> notes() const;

  private:
    std::vector<FlatChannel> channels_;
    std::int64_t count_ = 0;
};

/// Which images are samples that a dump has already: R, G, B equal bit for bit in all pixels.
class Duplicates {
  public:
    /// `before`: the dump's samples of the same rows.
    void add(const SampleBand& before, const SampleBand& band, std::size_t images);
    std::vector<std::string> notes(const FlatImages& images, const std::string& dump) const;

  private:
    std::vector<std::vector<std::uint64_t>> candidates_;  // of each image: numbers within a pixel
    bool first_ = true;
};

/// Whether parts of the light add up to all of it, R, G, B.
class LightSum {
  public:
    LightSum(const SampleBand& band, const Names& parts);
    void add(const SampleBand& band);
    /// sum |light - parts| / sum |light|
    double difference() const;
    /// sum (light - parts) / sum light: what is in none of them.
    double missing() const;

  private:
    std::vector<std::size_t> colours_;             // R, G, B
    std::vector<std::vector<std::size_t>> parts_;  // of each colour
    double light_ = 0, size_ = 0, lacking_ = 0, difference_ = 0;
};

}  // namespace vlx
