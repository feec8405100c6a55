#include "exr/flat_images.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>

#include "base/image_library.h"
#include "exr/flat_header.h"
#include "variolux/base/channel_names.h"
#include "variolux/base/error.h"
#include "variolux/base/hash.h"
#include "variolux/base/parallel.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

// More files than this are opened anew for every band: systems allow 1024 open files, often fewer.
constexpr std::size_t kOpenImages = 200;
// Values of all images together in a band, at four bytes, twice.
constexpr std::size_t kBandValues = std::size_t{8} << 20;
constexpr int kMaxBandRows = 32;
// Values of a row of one image, or of a row of its tiles.
constexpr std::int64_t kMaxStripValues = std::int64_t{1} << 28;

void checkRowLength(const std::string& path, const ImageInfo& info) {
    const std::int64_t rows = std::max(info.tileHeight, 1);
    const auto channels = static_cast<std::int64_t>(info.channels.size());
    if (info.data.width * channels * rows > kMaxStripValues)
        throw Error(path, "expected rows of at most 2^28 values, found " + std::to_string(info.data.width) +
                              " pixels of " + std::to_string(channels) + " channels");
}

}  // namespace

std::unique_ptr<ImageInput> openFlat(const std::string& path) {
    std::error_code status;
    if (!std::filesystem::is_regular_file(path, status))
        throw Error(path, "expected an image, found no such file");
    checkFlatHeader(path);
    std::string fault;
    auto input = imageLibrary().open(path, fault);
    if (!input) throw Error(path, "expected an image: " + fault);
    const ImageInfo& info = input->info();
    if (info.deep) throw Error(path, "expected a flat image, found deep samples: this is a dump already");
    if (info.data.width <= 0 || info.data.height <= 0 || info.channels.empty() || info.depth > 1)
        throw Error(path, "expected a flat image with pixels and channels, found none");
    return input;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

std::optional<ScaledChannel> parseScaled(const std::string& text) {
    const std::size_t star = text.find('*');
    if (star == std::string::npos || star + 1 == text.size()) return std::nullopt;
    ScaledChannel scaled{text.substr(star + 1)};
    const auto [end, status] = std::from_chars(text.data(), text.data() + star, scaled.factor);
    if (status != std::errc() || end != text.data() + star || !std::isfinite(scaled.factor) ||
        scaled.factor == 0)
        return std::nullopt;
    return scaled;
}

ScaledChannel channelFor(const std::vector<std::string>& names, const std::string& source) {
    if (contains(names, source)) return {source};
    return parseScaled(source).value_or(ScaledChannel{source});
}

// What is taken from one part of an image, in rows of interleaved values.
class FlatPart {
  public:
    FlatPart(int number, const ImageInfo& info) : number_(number), info_(info) {}

    const ImageInfo& info() const { return info_; }

    void take(int channel) {
        begin_ = std::min(begin_, channel);
        end_ = std::max(end_, channel + 1);
    }

    // Returns whether all went well.
    bool read(ImageInput& input, int y, int rows) {
        if (begin_ >= end_) return true;
        values_.resize(rowValues() * static_cast<std::size_t>(rows));
        return info_.tileWidth > 0 ? readTiles(input, y, rows)
                                   : input.readRows(number_, y, y + rows, begin_, end_, values_.data());
    }

    const std::vector<float>& values() const { return values_; }

    float value(std::size_t pixel, int channel) const {
        return values_[pixel * static_cast<std::size_t>(end_ - begin_) +
                       static_cast<std::size_t>(channel - begin_)];
    }

  private:
    std::size_t rowValues() const {
        return static_cast<std::size_t>(info_.data.width) * static_cast<std::size_t>(end_ - begin_);
    }

    // Tiles come in whole rows of tiles; the one read last is kept for the next band.
    bool readTiles(ImageInput& input, int y, int rows) {
        for (int row = y; row < y + rows; ++row) {
            const int first = row - (row - info_.data.y) % info_.tileHeight;
            const int last = std::min(first + info_.tileHeight, info_.data.y + info_.data.height);
            if (first != stripBegin_) {
                strip_.resize(rowValues() * static_cast<std::size_t>(last - first));
                stripBegin_ = std::numeric_limits<int>::min();
                if (!input.readTileRows(number_, first, last, begin_, end_, strip_.data())) return false;
                stripBegin_ = first;
            }
            std::copy_n(strip_.begin() + static_cast<std::ptrdiff_t>(rowValues()) * (row - first),
                        rowValues(), values_.begin() + static_cast<std::ptrdiff_t>(rowValues()) * (row - y));
        }
        return true;
    }

    int number_;
    ImageInfo info_;
    int begin_ = std::numeric_limits<int>::max();
    int end_ = 0;
    std::vector<float> values_;
    std::vector<float> strip_;
    int stripBegin_ = std::numeric_limits<int>::min();
};

class FlatImages::Source {
  public:
    Source(std::string path, bool keepOpen) : path_(std::move(path)), keepOpen_(keepOpen) {
        auto input = openFlat(path_);
        for (int number = 0; input->seek(number); ++number) {
            const ImageInfo& info = input->info();
            if (number > 0 && (info.deep || info.data != parts_.front().info().data ||
                               info.channels.empty() || info.depth > 1))
                continue;
            checkRowLength(path_, info);
            for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
                std::string known = partChannel(number, info.part, info.channels[channel]);
                if (contains(names_, known)) continue;
                names_.push_back(std::move(known));
                places_.push_back({parts_.size(), static_cast<int>(channel)});
            }
            parts_.emplace_back(number, info);
        }
        input->seek(0);
        if (keepOpen_) input_ = std::move(input);
    }

    std::size_t take(const std::string& name) {
        const auto found = std::find(names_.begin(), names_.end(), name);
        if (found == names_.end())
            throw Error(path_, "expected a channel " + name + ", found " + listed(names_));
        taken_.push_back(places_[static_cast<std::size_t>(found - names_.begin())]);
        parts_[taken_.back().part].take(taken_.back().channel);
        return taken_.size() - 1;
    }

    void read(int y, int rows) {
        if (taken_.empty()) return;
        auto input = keepOpen_ ? std::move(input_) : openFlat(path_);
        for (FlatPart& part : parts_) {
            if (!part.read(*input, y, rows))
                throw Error(path_, "rows " + std::to_string(y) + " to " + std::to_string(y + rows - 1) +
                                       ": " + input->error());
            hash_.add(std::as_bytes(std::span(part.values())));
        }
        if (keepOpen_) input_ = std::move(input);
    }

    float value(std::size_t pixel, std::size_t index) const {
        return parts_[taken_[index].part].value(pixel, taken_[index].channel);
    }
    std::string type(const std::string& name) const {
        const auto found = std::find(names_.begin(), names_.end(), name);
        if (found == names_.end()) return {};
        const Place& place = places_[static_cast<std::size_t>(found - names_.begin())];
        return parts_[place.part].info().types[static_cast<std::size_t>(place.channel)];
    }
    const std::string& path() const { return path_; }
    const ImageInfo& info() const { return parts_.front().info(); }
    const std::vector<std::string>& names() const { return names_; }
    Window data() const { return info().data; }
    Window display() const { return info().display; }
    std::uint64_t hash() const { return hash_.value(); }

  private:
    struct Place {
        std::size_t part = 0;
        int channel = 0;
    };

    std::string path_;
    bool keepOpen_;
    std::unique_ptr<ImageInput> input_;
    std::vector<FlatPart> parts_;
    std::vector<std::string> names_;
    std::vector<Place> places_;  // of each name
    std::vector<Place> taken_;
    ContentHash hash_;  // of all values read
};

FlatImages::FlatImages(std::vector<std::string> paths) {
    for (auto& path : paths) {
        sources_.push_back(std::make_unique<Source>(std::move(path), paths.size() <= kOpenImages));
        const Source& source = *sources_.back();
        const Source& first = *sources_.front();
        if (source.data() != first.data() || source.display() != first.display())
            throw Error(source.path(), "expected the windows of the first image, " +
                                           windowText(first.data()) + ", found " + windowText(source.data()) +
                                           " or another picture around it");
    }
}

FlatImages::~FlatImages() = default;

std::size_t FlatImages::size() const { return sources_.size(); }
const std::string& FlatImages::path(std::size_t image) const { return sources_[image]->path(); }
const std::vector<std::string>& FlatImages::channels(std::size_t image) const {
    return sources_[image]->names();
}
std::string FlatImages::type(std::size_t image, const std::string& channel) const {
    return sources_[image]->type(channel);
}
Window FlatImages::data() const { return sources_.front()->data(); }
Window FlatImages::display() const { return sources_.front()->display(); }

std::string FlatImages::text(std::size_t image, const std::string& attribute) const {
    return sources_[image]->info().text(attribute);
}

std::optional<double> FlatImages::number(std::size_t image, const std::string& attribute) const {
    return sources_[image]->info().number(attribute);
}

FlatChannel FlatImages::take(std::size_t image, const std::string& source) {
    const ScaledChannel channel = channelFor(channels(image), source);
    return {image, sources_[image]->take(channel.name), channel.factor};
}

int FlatImages::bandRows(std::size_t values) const {
    const std::size_t row = static_cast<std::size_t>(data().width) * std::max<std::size_t>(values, 1);
    return static_cast<int>(
        std::clamp<std::size_t>(kBandValues / row, 1, static_cast<std::size_t>(kMaxBandRows)));
}

void FlatImages::read(int y, int rows) {
    parallelFor(0, static_cast<std::int64_t>(sources_.size()),
                [&](std::int64_t i) { sources_[static_cast<std::size_t>(i)]->read(y, rows); });
}

float FlatImages::value(FlatChannel channel, std::size_t pixel) const {
    return channel.factor * sources_[channel.image]->value(pixel, channel.index);
}

std::uint64_t FlatImages::hash(std::size_t image) const { return sources_[image]->hash(); }

}  // namespace vlx
