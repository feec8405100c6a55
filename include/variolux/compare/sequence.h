#pragma once

#include <string>
#include <vector>

#include "variolux/base/image.h"
#include "variolux/compare/metrics.h"
#include "variolux/compare/statistics.h"

/// How wrong the frames of a sequence are, and how much their errors flicker: errors that stay where they are
/// are seen less than errors that change from frame to frame.
namespace vlx {

/// Side of the squares whose scatter the intervals of a sequence are from, in pixels: wider than denoisers'
/// errors are alike.
inline constexpr int kSequenceTile = 16;

/// One frame. With errors e = image - reference, pixel by pixel and channel by channel,
///
///     flicker = mean of (e_f(p) - e_(f-1)(q))^2 / (r_(f-1)(q)^2 + 0.01),
///
/// where q is p, as the picture lies; or the pixel in which the point that is seen at p was in the frame
/// before, p + motion: along motion, as an eye follows what moves. Nearest pixels, as interpolation would
/// take noise off e_(f-1). Left out are pixels that are not finite, whose motion is not known, or that come
/// from outside the picture; points that something hid in the frame before are not.
struct SequenceFrame {
    int number = 0;
    Comparison comparison;
    double flicker = 0;             ///< NaN where the frame before is not there
    double flickerAlongMotion = 0;  ///< NaN also where no motion is known
};

/// All frames. Means are over pixels, channels and frames; 95 % intervals from the scatter of squares of
/// kSequenceTile pixels, each with all its frames, of which a picture is taken to be a sample
/// (ratioInterval).
struct SequenceErrors {
    std::vector<SequenceFrame> frames;
    Interval relMse;
    Interval flicker;             ///< value NaN where no two frames follow each other
    Interval flickerAlongMotion;  ///< NaN also where no motion is known
};

/// Compares a sequence frame by frame, of which it keeps one.
class SequenceComparison {
  public:
    /// The next frame, with a higher number than the one before: it flickers where the number is the next
    /// one. Images as readColour() returns them. `motion`: an image of two channels, how far from a pixel, to
    /// the right and down, its point was in the frame before; not finite where that is not known; nullptr:
    /// nowhere. `path` names the image in errors. Throws Error, naming it, when its data window is not the
    /// reference's or those of the frame before.
    void add(int number, const Image& reference, const Image& image, const Image* motion = nullptr,
             const std::string& path = {});

    SequenceErrors errors() const;

  private:
    struct Sum {
        std::vector<double> sums, counts;  // of each tile
    };

    template <class Value>
    double addTiles(Sum& total, const Value& value) const;

    SequenceErrors errors_;
    Window window_;
    std::vector<double> before_;  // errors of the frame before, R, G, B by turns
    Image referenceBefore_;
    Sum relMse_, flicker_, alongMotion_;
};

}  // namespace vlx
