#include "variolux/dump/positions.h"

#include <algorithm>
#include <cmath>

#include "variolux/base/text.h"

namespace vlx {

namespace {

constexpr std::size_t kSomeOffsets = 4096;
// A convention is told by the samples that it has in their pixels: of those outside, and those of all
// samples.
constexpr double kMostExplained = 0.9;
constexpr double kLeastOutside = 0.25;

float median(std::vector<float> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

std::string number(double value) { return formatted("%.3g", value); }

std::string tenths(double value) { return number(std::round(value * 10) / 10 + 0.0); }

}  // namespace

const std::vector<PositionConventionName>& positionConventions() {
    using enum PositionConvention;
    static const std::vector<PositionConventionName> names = {
        {Raster, "raster", "raster coordinates: pixel (x, y) holds x to x + 1 and y to y + 1, downwards"},
        {Flipped, "flipped", "upside down: pixels, counted from the picture's bottom"},
        {Corner, "corner", "counted from the corner of the data window"},
        {Centre, "centre", "counted from the centre of the first pixel"},
        {Normalised, "normalised", "normalised, 0 to 1 over the picture"},
        {NormalisedFlipped, "normalised-flipped", "normalised, 0 to 1 over the picture, upside down"},
        {Ndc, "ndc", "normalised, -1 to 1 over the picture, y upwards"},
        {RelativeCentre, "relative-centre", "relative to the pixel's centre, -0.5 to 0.5"},
        {Relative, "relative", "relative to the pixel, 0 to 1"}};
    return names;
}

std::pair<double, double> rasterPosition(PositionConvention convention, const DumpHeader& header, int px,
                                         int py, double x, double y) {
    const Window& w = header.display;
    const auto over = [](int first, int count, double share) { return first + share * count; };
    switch (convention) {
        case PositionConvention::Raster:
            break;
        case PositionConvention::Flipped:
            return {x, 2.0 * w.y + w.height - y};
        case PositionConvention::Corner:
            return {header.data.x + x, header.data.y + y};
        case PositionConvention::Centre:
            return {x + 0.5, y + 0.5};
        case PositionConvention::Relative:
            return {px + x, py + y};
        case PositionConvention::RelativeCentre:
            return {px + 0.5 + x, py + 0.5 + y};
        case PositionConvention::Normalised:
            return {over(w.x, w.width, x), over(w.y, w.height, y)};
        case PositionConvention::NormalisedFlipped:
            return {over(w.x, w.width, x), over(w.y, w.height, 1 - y)};
        case PositionConvention::Ndc:
            return {over(w.x, w.width, (x + 1) / 2), over(w.y, w.height, (1 - y) / 2)};
    }
    return {x, y};
}

std::string toText(const PositionReport& report) {
    std::string text;
    const auto part = [&](std::uint64_t count, const std::string& what) {
        if (count == 0) return;
        const double share = 100 * static_cast<double>(count) / static_cast<double>(report.samples);
        text += (text.empty() ? "positions of " : "; those of ") + std::to_string(count) + " samples (" +
                number(share) + " %) " + what;
    };
    part(report.notFinite, "are not finite");
    part(report.outside, "lie outside their pixels, by up to " + number(report.furthest) + " pixels");
    if (report.outside == 0) return text;
    for (const auto& known : positionConventions())
        if (report.likely == known.convention) text += ": they look " + known.words;
    if (report.shift)
        text += ": they look shifted by (" + tenths(report.shift->first) + ", " +
                tenths(report.shift->second) + ") pixels";
    if (!report.likely && !report.shift) text += " (as of a pixel filter that is wider than a pixel)";
    return text + ". Expected " + positionConventions().front().words;
}

PositionCheck::PositionCheck(const DumpHeader& header)
    : header_(header), within_(positionConventions().size()) {
    const int x = findChannel(header, "sample.x");
    const bool half = x >= 0 && header.channels[static_cast<std::size_t>(x)].type == ChannelType::Half;
    tolerance_ = half ? 1e-3 : 1e-6;
}

void PositionCheck::add(const SampleBand& band) {
    for (int row = 0; row < band.height; ++row) add(band, row);
}

void PositionCheck::add(const SampleBand& band, int row) {
    const auto &xs = band.values[static_cast<std::size_t>(band.channel("sample.x"))],
               &ys = band.values[static_cast<std::size_t>(band.channel("sample.y"))];
    const auto width = static_cast<std::size_t>(band.width);
    // How far a position is outside a pixel. What is stored is rounded: a little more is still inside.
    const auto beyond = [&](int pixel, double position) {
        const double slack = tolerance_ * (1 + std::abs(pixel));
        return std::max(0.0, std::max(pixel - position, position - (pixel + 1.0)) - slack);
    };
    const int py = band.y + row;
    for (std::size_t col = 0; col < width; ++col) {
        const int px = band.x + static_cast<int>(col);
        const std::size_t p = static_cast<std::size_t>(row) * width + col;
        for (std::size_t s = band.offsets[p]; s < band.offsets[p + 1]; ++s) {
            ++counts_.samples;
            const double x = xs[s], y = ys[s];
            if (!std::isfinite(x) || !std::isfinite(y)) {
                ++counts_.notFinite;
                continue;
            }
            if (someOffsets_.size() < kSomeOffsets)
                someOffsets_.emplace_back(static_cast<float>(x - px - 0.5), static_cast<float>(y - py - 0.5));
            const double away = std::max(beyond(px, x), beyond(py, y));
            if (away <= 0) continue;
            ++counts_.outside;
            counts_.furthest = std::max(counts_.furthest, away);
            for (const auto& known : positionConventions()) {
                const auto [rx, ry] = rasterPosition(known.convention, header_, px, py, x, y);
                within_[static_cast<std::size_t>(known.convention)] +=
                    std::max(beyond(px, rx), beyond(py, ry)) <= 0;
            }
        }
    }
}

PositionReport PositionCheck::report() const {
    PositionReport report = counts_;
    const auto finite = static_cast<double>(report.samples - report.notFinite);
    const auto outside = static_cast<double>(report.outside);
    if (report.outside == 0 || outside < kLeastOutside * finite) return report;
    const auto explaining = std::ranges::find_if(within_, [&](std::uint64_t within) {
        return static_cast<double>(within) >= kMostExplained * outside;
    });
    if (explaining != within_.end()) {
        report.likely = static_cast<PositionConvention>(explaining - within_.begin());
        return report;
    }
    std::vector<float> dx, dy;
    for (const auto& [x, y] : someOffsets_) {
        dx.push_back(x);
        dy.push_back(y);
    }
    const float x = median(dx), y = median(dy);
    // Half a pixel, and what the medians of so many may be off.
    const auto within = std::ranges::count_if(someOffsets_, [&](const auto& d) {
        return std::abs(d.first - x) < 0.52f && std::abs(d.second - y) < 0.52f;
    });
    if (static_cast<double>(within) >= kMostExplained * static_cast<double>(someOffsets_.size()))
        report.shift = {x, y};
    return report;
}

PositionedSamples::PositionedSamples(const SampleSource& source, PositionConvention convention,
                                     bool checkAlways)
    : source_(source),
      convention_(convention),
      checkAlways_(checkAlways),
      check_(source.header()),
      checked_(static_cast<std::size_t>(source.header().data.height)) {}

SampleBand PositionedSamples::read(int y, int rows, const std::vector<std::string>& channels) const {
    std::vector<std::string> names = channels;
    if (checkAlways_ && !channels.empty())
        for (const char* name : {"sample.x", "sample.y"})
            if (std::ranges::find(names, name) == names.end() && findChannel(header(), name) >= 0)
                names.emplace_back(name);
    SampleBand band = source_.read(y, rows, names);
    const int xChannel = band.channel("sample.x"), yChannel = band.channel("sample.y");
    if (xChannel >= 0 && yChannel >= 0) {
        auto &xs = band.values[static_cast<std::size_t>(xChannel)],
             &ys = band.values[static_cast<std::size_t>(yChannel)];
        const auto width = static_cast<std::size_t>(band.width);
        for (std::size_t p = 0; convention_ != PositionConvention::Raster && p < band.pixels(); ++p)
            for (std::size_t s = band.offsets[p]; s < band.offsets[p + 1]; ++s) {
                const auto [rx, ry] =
                    rasterPosition(convention_, header(), band.x + static_cast<int>(p % width),
                                   band.y + static_cast<int>(p / width), xs[s], ys[s]);
                xs[s] = static_cast<float>(rx);
                ys[s] = static_cast<float>(ry);
            }
        for (int row = 0; row < rows; ++row) {
            auto checked =
                checked_[static_cast<std::size_t>(y - header().data.y) + static_cast<std::size_t>(row)];
            if (!checked) check_.add(band, row);
            checked = true;
        }
    }
    if (!channels.empty()) {
        band.channels.resize(channels.size());
        band.values.resize(channels.size());
    }
    return band;
}

}  // namespace vlx
