#include "sequence/motion_image.h"

#include <algorithm>
#include <cmath>

#include "exr/flat_header.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/base/text.h"
#include "variolux/dump/reader.h"

namespace vlx {

namespace {

constexpr int kMotionRows = 64;  // of a dump, read at once

const std::vector<std::string>& motionNames() {
    static const std::vector<std::string> names = {std::string(kMotionChannels[0]),
                                                   std::string(kMotionChannels[1])};
    return names;
}

void requireMotion(const std::string& path, const std::vector<std::string>& found) {
    for (const std::string& name : motionNames())
        if (std::find(found.begin(), found.end(), name) == found.end())
            throw Error(path, "expected channels " + listed(motionNames()) + ", found " + listed(found) +
                                  " (vlx-pack stack makes them of renderers' vectors)");
}

Image motionOfDump(const DumpReader& dump) {
    std::vector<std::string> channels;
    for (const DumpChannel& channel : dump.header().channels) channels.push_back(channel.name);
    requireMotion(dump.path(), channels);
    const Window& window = dump.header().data;
    Image motion(window, motionNames());
    float* out = motion.pixels.data();
    for (int row = 0; row < window.height; row += kMotionRows) {
        const SampleBand band =
            dump.read(window.y + row, std::min(kMotionRows, window.height - row), motionNames());
        for (std::size_t p = 0; p < band.pixels(); ++p)
            for (const std::vector<float>& values : band.values) {
                double sum = 0, count = 0;
                for (std::size_t s = band.offsets[p]; s < band.offsets[p + 1]; ++s) {
                    if (!std::isfinite(values[s])) continue;
                    sum += static_cast<double>(values[s]);
                    ++count;
                }
                *out++ = static_cast<float>(sum / count);  // 0 / 0: not known
            }
    }
    return motion;
}

}  // namespace

Image readMotion(const std::string& path, const Window& window) {
    Image motion;
    if (isFlatImage(path)) {
        const Image image = readImage(path);
        requireMotion(path, image.channels);
        motion = image.select(motionNames());
    } else {
        motion = motionOfDump(DumpReader(path));
    }
    if (motion.data != window)
        throw Error(path, "expected the reference's data window, " + windowText(window) + ", found " +
                              windowText(motion.data));
    return motion;
}

}  // namespace vlx
