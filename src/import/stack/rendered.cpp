#include "import/stack/rendered.h"

#include <algorithm>

#include "variolux/base/text.h"

namespace vlx {

namespace {

// Between Cycles' 1e10 of a miss and Blender's 1e11 of what was not rendered.
constexpr float kNotRendered = 5e10f;

// Where pixels are not 0.
class Extent {
  public:
    Extent(const std::vector<std::string>& paths, const StackPlan& plan) : images_(paths) {
        std::size_t taken = 0;
        for (const char* name :
             {"R", "G", "B", "A", "Z", "albedo.R", "albedo.G", "albedo.B", "N.X", "N.Y", "N.Z"})
            if (const auto source = plan.mapped.find(name); source != plan.mapped.end()) {
                if (name == std::string("A")) alpha_ = channels_.size();
                channels_.push_back(takeFromAll(images_, {{source->second}, {}}));
                taken += images_.size();
            }
        rows_ = images_.bandRows(taken);
    }

    bool cornersAreFull() {
        const Window w = images_.data();
        for (const int y : {w.y, w.y + w.height - 1}) {
            images_.read(y, 1);
            if (isEmpty(0) || isEmpty(static_cast<std::size_t>(w.width) - 1)) return false;
        }
        return true;
    }

    // The rectangle that the pixels which are not 0 fill; nothing if they do not fill one, or if a side of it
    // is the edge of a thing: pixels that it covers in part. A border cuts through what is as opaque as
    // elsewhere.
    std::optional<Window> rectangle() {
        const Window w = images_.data();
        int left = w.width, right = 0, top = w.height, bottom = 0;
        std::int64_t full = 0;
        std::vector<int> softOfRow(static_cast<std::size_t>(w.height)),
            softOfColumn(static_cast<std::size_t>(w.width));
        for (int row = 0; row < w.height;) {
            const int rows = std::min(rows_, w.height - row);
            images_.read(w.y + row, rows);
            for (int r = 0; r < rows; ++r)
                for (int col = 0; col < w.width; ++col) {
                    const std::size_t pixel =
                        static_cast<std::size_t>(r) * static_cast<std::size_t>(w.width) +
                        static_cast<std::size_t>(col);
                    if (isEmpty(pixel)) continue;
                    ++full;
                    if (isSoft(pixel)) {
                        ++softOfRow[static_cast<std::size_t>(row + r)];
                        ++softOfColumn[static_cast<std::size_t>(col)];
                    }
                    left = std::min(left, col);
                    right = std::max(right, col + 1);
                    top = std::min(top, row + r);
                    bottom = std::max(bottom, row + r + 1);
                }
            row += rows;
        }
        if (full == 0 || full != std::int64_t{right - left} * (bottom - top)) return std::nullopt;
        const auto isEdge = [](const std::vector<int>& soft, int at, int length) {
            return 2 * soft[static_cast<std::size_t>(at)] > length;
        };
        if ((top > 0 && isEdge(softOfRow, top, right - left)) ||
            (bottom < w.height && isEdge(softOfRow, bottom - 1, right - left)) ||
            (left > 0 && isEdge(softOfColumn, left, bottom - top)) ||
            (right < w.width && isEdge(softOfColumn, right - 1, bottom - top)))
            return std::nullopt;
        return Window{w.x + left, w.y + top, right - left, bottom - top};
    }

  private:
    bool isSoft(std::size_t pixel) const {
        return std::ranges::any_of(channels_[alpha_],
                                   [&](const Mixture& ofImage) { return ofImage.value(images_, pixel) < 1; });
    }

    bool isEmpty(std::size_t pixel) const {
        for (const auto& channel : channels_)
            for (const Mixture& ofImage : channel)
                if (ofImage.value(images_, pixel) != 0) return false;
        return true;
    }

    FlatImages images_;
    std::vector<std::vector<Mixture>> channels_;
    std::size_t alpha_ = 0;  // among them
    int rows_ = 1;
};

}  // namespace

RenderedPixels::RenderedPixels(FlatImages& images, const StackPlan& plan, bool keepEmpty) {
    if (keepEmpty || plan.preset != StackPreset::Cycles || !plan.mapped.contains("A")) return;
    for (const char* end : {"Depth.Z", "Depth.V"}) {
        const std::string name = plan.layer + end;
        std::size_t having = 0;
        while (having < images.size() && contains(images.channels(having), name)) ++having;
        if (having < images.size()) continue;
        for (std::size_t i = 0; i < images.size(); ++i) depth_.push_back(images.take(i, name));
        return;
    }
    std::vector<std::string> paths;
    for (std::size_t i = 0; i < images.size(); ++i) paths.push_back(images.path(i));
    Extent extent(paths, plan);
    if (extent.cornersAreFull()) return;
    border_ = extent.rectangle();
    unclear_ = !border_;
}

std::vector<char> RenderedPixels::of(const FlatImages& images, const SampleBand& band) {
    std::vector<char> rendered(band.pixels(), 1);
    if (depth_.empty() && !border_) return rendered;
    const std::size_t count = images.size();
    std::vector<const std::vector<float>*> colours;
    for (const char* name : {"R", "G", "B", "A"})
        colours.push_back(&band.values[static_cast<std::size_t>(band.channel(name))]);
    const auto isFar = [&](std::size_t pixel) {
        return std::ranges::all_of(depth_,
                                   [&](FlatChannel z) { return images.value(z, pixel) > kNotRendered; });
    };
    const auto isBlack = [&](std::size_t pixel) {
        return std::ranges::all_of(colours, [&](const std::vector<float>* values) {
            const auto begin = values->begin() + static_cast<std::ptrdiff_t>(pixel * count);
            return std::all_of(begin, begin + static_cast<std::ptrdiff_t>(count),
                               [](float v) { return v == 0; });
        });
    };
    for (std::size_t p = 0; p < rendered.size(); ++p) {
        const int x = band.x + static_cast<int>(p % static_cast<std::size_t>(band.width));
        const int y = band.y + static_cast<int>(p / static_cast<std::size_t>(band.width));
        if (border_ ? border_->contains(x, y) : !(isFar(p) && isBlack(p))) continue;
        rendered[p] = 0;
        ++left_;
    }
    return rendered;
}

std::vector<std::string> RenderedPixels::notes() const {
    std::vector<std::string> notes;
    if (left_ > 0)
        notes.push_back(
            "WARNING: " + std::to_string(left_) +
            " pixels were not rendered (0 in everything, alpha included, " +
            (border_ ? "all around " + windowText(*border_) : "and no depth of a miss") +
            "): they get no samples and are predicted from their neighbours. Turn the render border "
            "off, or crop to it; --keep-empty takes them for what a transparent film shows.");
    if (unclear_)
        notes.push_back(
            "Pixels that are 0 in everything, alpha included, are kept as a transparent film's misses. If a "
            "render border or tiles that were not rendered made them, crop to the border or turn the pass Z "
            "on, "
            "which tells them apart.");
    return notes;
}

}  // namespace vlx
