#include "import/stack/pass_file.h"

#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <fstream>
#include <set>

#include "exr/header_copy.h"
#include "import/stack/cryptomatte.h"
#include "variolux/base/error.h"
#include "variolux/base/fingerprint.h"
#include "variolux/base/output_file.h"
#include "variolux/base/parallel.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

constexpr float kMissed = 1e9f;  // depths from here on are those of nothing

// A channel of the file, and the rows of it at work.
struct Plane {
    std::string name;
    Imf::PixelType type = Imf::FLOAT;
    PassKind kind = PassKind::Mean;
    std::vector<Mixture> ofImages;               // none: a cryptomatte's, which fills `values`
    std::vector<std::vector<FlatChannel>> pass;  // of each image, all channels of the pass
    bool found = false;                          // in any pixel so far
    std::vector<float> values;
    std::vector<char> rows;
};

Imf::PixelType typeOf(const std::string& name) { return name == "half" ? Imf::HALF : Imf::FLOAT; }

// Neither 0 nor infinitely far away.
bool isSomething(float value) { return value != 0 && value < kMissed; }

// Whether an image has the pass in a pixel.
bool has(const FlatImages& images, const std::vector<FlatChannel>& pass, std::size_t pixel) {
    return std::ranges::any_of(
        pass, [&](FlatChannel channel) { return isSomething(images.value(channel, pixel)); });
}

float valueOf(const FlatImages& images, const Plane& plane, std::size_t pixel) {
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < plane.ofImages.size(); ++i) {
        if (plane.kind != PassKind::Mean && !has(images, plane.pass[i], pixel)) continue;
        const float value = plane.ofImages[i].value(images, pixel);
        if (plane.kind == PassKind::FirstSample) return value;
        sum += value;
        ++count;
    }
    return count > 0 ? static_cast<float>(sum / count) : plane.ofImages.front().value(images, pixel);
}

// The bytes of a row's values, as the file has them.
void store(Plane& plane) {
    if (plane.type == Imf::FLOAT) {
        plane.rows.resize(plane.values.size() * sizeof(float));
        std::memcpy(plane.rows.data(), plane.values.data(), plane.rows.size());
        return;
    }
    plane.rows.resize(plane.values.size() * sizeof(half));
    for (std::size_t i = 0; i < plane.values.size(); ++i) {
        const half value(plane.values[i]);
        std::memcpy(plane.rows.data() + i * sizeof value, &value, sizeof value);
    }
}

Imf::Header headerOf(const std::string& path) {
    try {
        return Imf::MultiPartInputFile(path.c_str(), 0).header(0);
    } catch (const std::exception& error) {
        throw Error(path,
                    std::string("expected an OpenEXR file, as --passes copies its header: ") + error.what());
    }
}

// "L.CryptoObject" and so on, as the attributes cryptomatte/ID/name say.
Names cryptomattes(const Imf::Header& header) {
    Names names;
    for (auto it = header.begin(); it != header.end(); ++it) {
        const std::string attribute = it.name();
        const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute());
        if (text != nullptr && attribute.starts_with("cryptomatte/") && attribute.ends_with("/name"))
            names.push_back(text->value());
    }
    return names;
}

// The first image's, for a file of scanlines of these channels.
Imf::Header fileHeader(const Imf::Header& first, const std::vector<Plane>& planes, const std::string& layer,
                       double samples, const std::string& inputs) {
    std::set<std::string> left = {"name", "type", "version", "chunkCount", "tiles", "view"};
    for (auto it = first.begin(); it != first.end(); ++it)  // times of one image
        if (const std::string name = it.name();
            name == "RenderTime" || (name.starts_with("cycles.") && name.ends_with("_time")))
            left.insert(name);
    Imf::Header header = headerWithout(first, left);
    const std::string ofLayer = "cycles." + layer + "samples";
    if (samples > 0 && header.findTypedAttribute<Imf::StringAttribute>(ofLayer))
        header.insert(ofLayer, Imf::StringAttribute(formatted("%.0f", samples)));
    if (!inputs.empty()) header.insert(kInputsAttribute, Imf::StringAttribute(inputs));
    header.channels() = Imf::ChannelList();
    for (const Plane& plane : planes) header.channels().insert(plane.name, Imf::Channel(plane.type));
    header.lineOrder() = Imf::INCREASING_Y;
    const Imf::Compression used = header.compression();
    if (used >= Imf::B44_COMPRESSION || used == Imf::PXR24_COMPRESSION)  // they lose bits
        header.compression() = Imf::ZIP_COMPRESSION;
    return header;
}

}  // namespace

struct PassFile::Impl {
    FlatImages& images;
    OutputFile file;
    std::vector<Plane> planes;
    std::vector<Cryptomatte> mattes;
    std::vector<std::size_t> firstOfMatte;  // of its channels among the planes
    std::atomic<std::int64_t> crowded = 0;  // pixels of more ids than ranks
    std::ofstream bytes;
    std::unique_ptr<Imf::StdOFStream> stream;
    std::unique_ptr<Imf::OutputFile> out;
    int row = 0;

    Impl(const std::string& path, FlatImages& from, const StackPlan& plan) : images(from), file(path) {
        const Imf::Header first = headerOf(images.path(0));
        Names taken;
        for (const std::string& name : cryptomattes(first)) {
            mattes.emplace_back(images, name);
            firstOfMatte.push_back(planes.size());
            for (const std::string& channel : mattes.back().channels()) {
                planes.push_back(
                    {channel, typeOf(images.type(0, channel)), PassKind::Mean, {}, {}, false, {}, {}});
                taken.push_back(channel);
            }
        }
        for (const Contribution& part : plan.contributions)
            for (std::size_t c = 0; c < 3; ++c) {
                const std::string name = part.name + "." + "RGB"[c];
                for (const std::string& source : part.colours[c].sum) taken.push_back(source);
                const bool whole = contains(images.channels(0), name);
                add(name, whole ? typeOf(images.type(0, name)) : Imf::FLOAT, part.colours[c]);
            }
        const Names names = images.channels(0);
        for (const std::string& name : names)
            if (!contains(taken, name)) add(name, typeOf(images.type(0, name)), {{name}, {}});
    }

    void add(const std::string& name, Imf::PixelType type, const Recipe& recipe) {
        Plane& plane = planes.emplace_back();
        plane.name = name;
        plane.type = type;
        plane.kind = passKind(name);
        plane.ofImages = takeFromAll(images, recipe);
        if (plane.kind == PassKind::Mean) return;
        const std::string prefix = name.substr(0, name.find_last_of('.') + 1);
        for (std::size_t i = 0; i < images.size(); ++i) {
            auto& pass = plane.pass.emplace_back();
            for (const std::string& other : images.channels(i))
                if (other.starts_with(prefix) && other.find('.', prefix.size()) == std::string::npos)
                    pass.push_back(images.take(i, other));
        }
    }

    // Images come with all channels of a pixel together: a few pixels at a time stay in the cache.
    void average(std::size_t pixels) {
        constexpr std::size_t kBlock = 64;
        for (Plane& plane : planes) plane.values.resize(pixels);
        parallelFor(0, static_cast<std::int64_t>((pixels + kBlock - 1) / kBlock), [&](std::int64_t block) {
            const std::size_t begin = static_cast<std::size_t>(block) * kBlock;
            average(begin, std::min(begin + kBlock, pixels));
        });
        parallelFor(0, static_cast<std::int64_t>(planes.size()), [&](std::int64_t i) {
            Plane& plane = planes[static_cast<std::size_t>(i)];
            plane.found = plane.found || std::ranges::any_of(plane.values, isSomething);
            store(plane);
        });
    }

    void average(std::size_t begin, std::size_t end) {
        for (Plane& plane : planes)
            if (!plane.ofImages.empty())
                for (std::size_t p = begin; p < end; ++p) plane.values[p] = valueOf(images, plane, p);
        for (std::size_t m = 0; m < mattes.size(); ++m) {
            std::vector<float> ranks(mattes[m].channels().size());
            for (std::size_t p = begin; p < end; ++p) {
                if (mattes[m].merge(images, p, ranks.data()) > 0) ++crowded;
                for (std::size_t c = 0; c < ranks.size(); ++c)
                    planes[firstOfMatte[m] + c].values[p] = ranks[c];
            }
        }
    }
};

PassFile::PassFile(const std::string& path, FlatImages& images, const StackPlan& plan, double samples,
                   const std::string& inputs)
    : impl_(std::make_unique<Impl>(path, images, plan)) {
    impl_->bytes.open(impl_->file.temporaryPath(), std::ios::binary);
    try {
        impl_->stream = std::make_unique<Imf::StdOFStream>(impl_->bytes, impl_->file.temporaryPath().c_str());
        impl_->out = std::make_unique<Imf::OutputFile>(
            *impl_->stream, fileHeader(headerOf(images.path(0)), impl_->planes, plan.layer, samples, inputs),
            0);
    } catch (const Error&) {
        throw;
    } catch (const std::exception& error) {
        throw Error(path, std::string("writing failed: ") + error.what());
    }
}

PassFile::~PassFile() = default;

void PassFile::write(int rows) {
    const Window window = impl_->images.data();
    impl_->average(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(rows));
    Imf::FrameBuffer frame;
    for (Plane& plane : impl_->planes) {
        const std::size_t size = plane.type == Imf::HALF ? sizeof(half) : sizeof(float);
        frame.insert(plane.name, Imf::Slice::Make(plane.type, plane.rows.data(),
                                                  {window.x, window.y + impl_->row}, window.width, rows, size,
                                                  size * static_cast<std::size_t>(window.width)));
    }
    try {
        impl_->out->setFrameBuffer(frame);
        impl_->out->writePixels(rows);
    } catch (const std::exception& error) {
        throw Error(impl_->file.path(), std::string("writing failed: ") + error.what());
    }
    impl_->row += rows;
}

void PassFile::close() {
    impl_->out.reset();
    impl_->bytes.close();
    if (!impl_->bytes) throw Error(impl_->file.path(), "writing to disk failed");
    impl_->file.commit();
}

std::vector<std::string> PassFile::notes(bool added) const {
    std::vector<std::string> notes;
    if (impl_->crowded > 0)
        notes.push_back(std::to_string(impl_->crowded) +
                        " pixels have more cryptomatte ids than the file has ranks: the least are left out.");
    if (added) return notes;
    Names ofFirst;
    bool found = false;
    for (const Plane& plane : impl_->planes) {
        if (plane.kind != PassKind::FirstSample) continue;
        found = found || plane.found;
        if (!contains(ofFirst, passOf(plane.name))) ofFirst.push_back(passOf(plane.name));
    }
    if (!ofFirst.empty() && !found)
        notes.push_back("No image has anything in " + listed(ofFirst) +
                        ": Cycles records these passes of its sample 0 alone, which none of the images has. "
                        "To have them, render image i (from 0) from the sample offset i * samples.");
    return notes;
}

}  // namespace vlx
