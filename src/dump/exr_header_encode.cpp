// encodeHeader(): from a dump's header to the bytes of an OpenEXR file's.
#include <ImfChannelList.h>
#include <ImfCompressionAttribute.h>
#include <ImfDeepImageState.h>
#include <ImfDoubleAttribute.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfIntAttribute.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfVersion.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "dump/exr_attributes.h"
#include "dump/exr_header.h"
#include "exr/header_walker.h"
#include "exr/little_endian.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"
#include "variolux/dump/splats.h"

namespace vlx {

namespace {

class MemoryOutput : public Imf::OStream {
  public:
    explicit MemoryOutput(Bytes& bytes) : Imf::OStream("header"), bytes_(bytes) {}
    void write(const char from[], int count) override {
        const auto end = at_ + static_cast<std::size_t>(count);
        if (end > bytes_.size()) bytes_.resize(end);
        std::memcpy(bytes_.data() + at_, from, static_cast<std::size_t>(count));
        at_ = end;
    }
    std::uint64_t tellp() override { return at_; }
    void seekp(std::uint64_t to) override { at_ = to; }

  private:
    Bytes& bytes_;
    std::size_t at_ = 0;
};

Imath::Box2i toBox(const Window& window) {
    return {{window.x, window.y}, {window.x + (window.width - 1), window.y + (window.height - 1)}};
}

Imf::Compression fromCompression(DumpCompression compression) {
    switch (compression) {
        case DumpCompression::None:
            return Imf::NO_COMPRESSION;
        case DumpCompression::Rle:
            return Imf::RLE_COMPRESSION;
        default:
            return Imf::ZIPS_COMPRESSION;
    }
}

Imf::PixelType fromType(ChannelType type) {
    switch (type) {
        case ChannelType::Half:
            return Imf::HALF;
        case ChannelType::Uint:
            return Imf::UINT;
        default:
            return Imf::FLOAT;
    }
}

}  // namespace

void checkHeader(const std::string& path, const DumpHeader& header) {
    for (const Window& window : {header.data, header.display}) {
        if (!isPossible(window.x, window.y, window.width, window.height))
            throw Error(path, "expected a window of pixels within 2^30 of 0, found " + windowText(window));
    }
    std::set<std::string> names;
    for (const auto& channel : header.channels) {
        if (channel.name.empty() || channel.name.size() > 255 || channel.name.find('\0') != std::string::npos)
            throw Error(path, "expected channel names of 1 to 255 bytes, found '" + channel.name + "'");
        if (!names.insert(channel.name).second) throw Error(path, "two channels are named " + channel.name);
    }
    for (const char* name : {"R", "G", "B"})
        if (!names.contains(name)) throw Error(path, std::string("a dump needs a channel ") + name);
    for (const auto* matrix : {&header.worldToCamera, &header.worldToNDC})
        if (*matrix && (*matrix)->size() != 16) throw Error(path, "expected matrices of 16 values");
    if (header.splatReplicates < 0 || header.splatReplicates > kMostSplatReplicates)
        throw Error(path, "expected at most " + std::to_string(kMostSplatReplicates) +
                              " replicates of splats, found " + std::to_string(header.splatReplicates));
    if (header.splatReplicates > 1 && !names.contains("sample.replicate"))
        throw Error(path, "splats of several replicates need a channel sample.replicate");
    for (const auto& effect : header.effects)
        if (effect.empty() || effect.find(',') != std::string::npos)
            throw Error(path, "expected names of effects without commas, found '" + effect + "'");
}

std::vector<std::string> beautyChannels(const DumpHeader& dump) {
    std::vector<std::string> names;
    for (const char* name : {"A", "B", "G", "R", "Z"})
        if (findChannel(dump, name) >= 0) names.emplace_back(name);
    return names;
}

EncodedHeader encodeHeader(const std::string& path, const DumpHeader& dump) {
    EncodedHeader encoded;
    try {
        Imf::Header common(toBox(dump.display), toBox(dump.data));
        common.compression() = fromCompression(dump.compression);
        common.lineOrder() = Imf::INCREASING_Y;
        common.setChunkCount(dump.data.height);
        if (dump.worldToCamera) {
            Imath::M44f m;
            std::copy_n(dump.worldToCamera->begin(), 16, &m.x[0][0]);
            Imf::addWorldToCamera(common, m);
        }
        if (dump.worldToNDC) {
            Imath::M44f m;
            std::copy_n(dump.worldToNDC->begin(), 16, &m.x[0][0]);
            Imf::addWorldToNDC(common, m);
        }
        for (const auto& [name, text] : dump.extra) {
            if (isReserved(name))
                throw Error(path, "attribute '" + name + "' may not be set as an extra one");
            common.insert(name, Imf::StringAttribute(text));
        }

        Imf::Header beauty = common;
        beauty.setName("beauty");
        beauty.setType(Imf::SCANLINEIMAGE);
        // Only deep parts need it, but OpenEXRCore (3.1) asks for it in every part of a file that has one.
        beauty.setVersion(1);
        for (const auto& name : beautyChannels(dump))
            beauty.channels().insert(name, Imf::Channel(Imf::FLOAT));

        Imf::Header samples = common;
        samples.setName("samples");
        samples.setType(Imf::DEEPSCANLINE);
        samples.setVersion(1);
        for (const auto& channel : dump.channels)
            samples.channels().insert(channel.name, Imf::Channel(fromType(channel.type)));
        Imf::addDeepImageState(samples, Imf::DIS_MESSY);
        samples.insert(kMaxSamples, Imf::IntAttribute(0));
        samples.insert(kVersion, Imf::IntAttribute(dump.version));
        const auto text = [&](const char* name, const std::string& content) {
            if (!content.empty()) samples.insert(name, Imf::StringAttribute(content));
        };
        text(kRenderer, dump.renderer);
        text(kScene, dump.scene);
        text(kPixelFilter, dump.pixelFilter);
        text(kEffects, listed(dump.effects, ","));
        if (dump.replicatesShare) samples.insert(kReplicatesShare, Imf::IntAttribute(1));
        if (dump.independentHalves) samples.insert(kIndependentHalves, Imf::IntAttribute(1));
        if (dump.seed) text(kSeed, std::to_string(*dump.seed));
        if (dump.samples) samples.insert(kSamples, Imf::DoubleAttribute(*dump.samples));
        if (dump.averaged > 1) samples.insert(kAveraged, Imf::DoubleAttribute(dump.averaged));
        samples.insert(kRenderSeconds, Imf::DoubleAttribute(dump.renderSeconds.value_or(0)));

        std::vector<Imf::Header*> parts = {&beauty, &samples};
        Imf::Header splats = common;
        if (dump.splatReplicates > 0) {
            splats.setName("splats");
            splats.setType(Imf::SCANLINEIMAGE);
            splats.setVersion(1);
            for (const auto& name : splatChannels(dump.splatReplicates))
                splats.channels().insert(name, Imf::Channel(Imf::FLOAT));
            splats.insert(kSplatReplicates, Imf::IntAttribute(dump.splatReplicates));
            parts.push_back(&splats);
        }

        MemoryOutput out(encoded.bytes);
        // The flags say: deep data, several parts, and names of up to 255 bytes.
        const std::array<std::uint32_t, 2> start = {
            static_cast<std::uint32_t>(Imf::MAGIC),
            static_cast<std::uint32_t>(Imf::EXR_VERSION | Imf::NON_IMAGE_FLAG | Imf::MULTI_PART_FILE_FLAG |
                                       Imf::LONG_NAMES_FLAG)};
        for (const std::uint32_t word : start) append(encoded.bytes, word);
        out.seekp(encoded.bytes.size());
        for (Imf::Header* part : parts) {
            part->sanityCheck(false, true);
            part->writeTo(out);
        }
        encoded.bytes.push_back(0);
    } catch (const Error&) {
        throw;
    } catch (const std::exception& error) {
        throw Error(path, std::string("this header cannot be written: ") + error.what());
    }

    HeaderWalker walker(path, encoded.bytes, encoded.bytes.size());
    walker.word();
    walker.word();
    walker.header();
    const auto samples = walker.header();
    encoded.renderSeconds = findAttribute(samples, kRenderSeconds)->value;
    encoded.maxSamplesPerPixel = findAttribute(samples, kMaxSamples)->value;
    return encoded;
}

}  // namespace vlx
