#pragma once

namespace vlx {

/// How a channel is stored. In memory every channel is float: HALF widens exactly, UINT is exact to 2^24.
enum class ChannelType { Half, Float, Uint };

/// The lossless compressions that OpenEXR allows in deep files.
enum class DumpCompression { None, Rle, Zips };

}  // namespace vlx
