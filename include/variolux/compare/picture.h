#pragma once

#include <string>
#include <vector>

#include "variolux/base/image.h"

namespace vlx {

/// A colour image (see readColour) and how pictures caption it.
struct CaptionedImage {
    std::string name;
    std::string note;  ///< a second line, for example a metric; may be empty
    Image image;
};

struct PictureOptions {
    double exposure = 0;        ///< stops: radiance is multiplied by 2^exposure before it is shown
    std::vector<Window> crops;  ///< in raster coordinates of the images
    double signedRange = 0;     ///< error at the ends of the signed scale; 0: see signedErrors
};

/// A crop from text "x,y,width,height". Throws Error on anything else, and on an empty crop.
Window parseCrop(const std::string& text);

// Every function below returns a picture of display values (channels R, G, B in [0, 1]) to be written as PNG:
// a grid of panels of one size, each with its caption above, in as many columns as fit into 2,400 pixels.
// Small images are enlarged by a whole factor (nearest neighbour) until the longer side has at least 384
// pixels. Radiance is shown through the sRGB transfer function; pixels that are not finite are
// kNonFiniteColour. All images must have the same data window, and crops must lie inside it: Error otherwise,
// naming both.

/// The images side by side, with the crops outlined in numbered colours.
Image sideBySide(const std::vector<CaptionedImage>& images, const PictureOptions& options = {});

/// One row of panels a crop, one column an image, enlarged so that single pixels can be seen, framed in the
/// colour of the crop's outline in sideBySide. Throws Error without crops.
Image enlargedCrops(const std::vector<CaptionedImage>& images, const PictureOptions& options);

/// Maps of the mean over channels of x - r, with divergingColour: red is too bright, blue too dark. One scale
/// for all: from -s to s, where s is options.signedRange, or the smallest 1, 2 or 5 times a power of ten that
/// 99 % of all |errors| do not exceed. A legend with numbers stands below.
Image signedErrors(const Image& reference, const std::vector<CaptionedImage>& images,
                   const PictureOptions& options = {});

/// Maps of the mean over channels of |x - r| / (|r| + 0.01), with sequentialColour on a logarithmic scale
/// from 0.1 % to 100 %, always the same, so that pictures of different runs compare. A legend with numbers
/// stands below.
Image relativeErrors(const Image& reference, const std::vector<CaptionedImage>& images);

}  // namespace vlx
