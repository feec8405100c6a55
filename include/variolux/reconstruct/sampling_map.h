#pragma once

#include "variolux/base/image.h"

namespace vlx {

/// Where the next samples of a picture are wanted, for vlx-trace --append --sample-map: channel
/// `sampling.density`, of mean 1,
///     density = sqrt(mean over colours of stddev^2 / (value^2 + 0.01)),
/// the standard deviation of a pixel's error by the measure of relMSE. Errors fall with the root of the
/// number of samples: shares in proportion to the standard deviations of equal numbers of samples lower the
/// sum of squares most (Neyman 1934). `estimate`: R, G, B, stddev.R, .G, .B, as reconstructions have them.
/// Where no pixel has an error every density is 1.
Image samplingMap(const Image& estimate);

}  // namespace vlx
