#include "exr/part_layout.h"

#include <algorithm>
#include <set>

#include "variolux/base/error.h"

namespace vlx {

namespace {

std::int64_t right(const Window& w) { return std::int64_t{w.x} + w.width; }
std::int64_t bottom(const Window& w) { return std::int64_t{w.y} + w.height; }

std::string range(std::int64_t first, std::int64_t end) {
    return std::to_string(first) + " to " + std::to_string(end - 1);
}

}  // namespace

Window boundsOf(const std::vector<PicturePart>& parts) {
    std::int64_t x0 = parts.front().data.x, y0 = parts.front().data.y, x1 = x0, y1 = y0;
    for (const PicturePart& part : parts) {
        x0 = std::min<std::int64_t>(x0, part.data.x);
        y0 = std::min<std::int64_t>(y0, part.data.y);
        x1 = std::max(x1, right(part.data));
        y1 = std::max(y1, bottom(part.data));
    }
    return {static_cast<int>(x0), static_cast<int>(y0), static_cast<int>(x1 - x0), static_cast<int>(y1 - y0)};
}

void arrangeParts(std::vector<PicturePart>& parts, const Window& whole, const std::string& output) {
    std::sort(parts.begin(), parts.end(), [](const PicturePart& a, const PicturePart& b) {
        return std::pair(a.data.y, a.data.x) < std::pair(b.data.y, b.data.x);
    });
    // Between two neighbouring borders of rows, the same parts lie side by side.
    std::set<std::int64_t> borders = {whole.y, bottom(whole)};
    for (const PicturePart& part : parts) {
        if (part.data.x < whole.x || part.data.y < whole.y || right(part.data) > right(whole) ||
            bottom(part.data) > bottom(whole))
            throw Error(part.path, "holds " + windowText(part.data) + ", expected a part of the picture of " +
                                       windowText(whole));
        borders.insert(part.data.y);
        borders.insert(bottom(part.data));
    }
    for (auto top = borders.begin(), low = std::next(top); low != borders.end(); ++top, ++low) {
        std::vector<const PicturePart*> row;
        for (const PicturePart& part : parts)
            if (part.data.y <= *top && bottom(part.data) >= *low) row.push_back(&part);
        std::sort(row.begin(), row.end(),
                  [](const PicturePart* a, const PicturePart* b) { return a->data.x < b->data.x; });
        const auto missing = [&](std::int64_t first, std::int64_t end) {
            throw Error(output,
                        "no part holds rows " + range(*top, *low) + ", columns " + range(first, end) +
                            (boundsOf(parts) == whole ? "" : " (--crop: they are of a part of the picture)"));
        };
        std::int64_t next = whole.x;
        const PicturePart* last = nullptr;
        for (const PicturePart* part : row) {
            if (part->data.x < next && last != nullptr)
                throw Error(part->path, "overlaps " + last->path + " in rows " + range(*top, *low));
            if (part->data.x > next) missing(next, part->data.x);
            next = right(part->data);
            last = part;
        }
        if (next != right(whole)) missing(next, right(whole));
    }
}

}  // namespace vlx
