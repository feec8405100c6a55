#include "render/math/transform.h"

namespace vlx::render {
namespace {

/// Cofactor of A at (row, col), with its sign (indices cyclic).
double cofactor(const Transform& t, std::size_t row, std::size_t col) {
    const std::size_t r1 = (row + 1) % 3, r2 = (row + 2) % 3, c1 = (col + 1) % 3, c2 = (col + 2) % 3;
    return t.m[r1][c1] * t.m[r2][c2] - t.m[r1][c2] * t.m[r2][c1];
}

}  // namespace

Vec3 Transform::normal(const Vec3& n) const {
    const double sign = determinant() < 0 ? -1 : 1;
    const auto row = [&](std::size_t i) {
        return static_cast<float>(
            sign * (cofactor(*this, i, 0) * n.x + cofactor(*this, i, 1) * n.y + cofactor(*this, i, 2) * n.z));
    };
    return {row(0), row(1), row(2)};
}

double Transform::determinant() const {
    return m[0][0] * cofactor(*this, 0, 0) + m[0][1] * cofactor(*this, 0, 1) +
           m[0][2] * cofactor(*this, 0, 2);
}

std::optional<Transform> Transform::inverse() const {
    const double det = determinant();
    if (!(std::abs(det) > 0) || !std::isfinite(1 / det)) return std::nullopt;
    Transform result;
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) result.m[i][j] = cofactor(*this, j, i) / det;
    }
    for (auto& r : result.m) r[3] = -(r[0] * m[0][3] + r[1] * m[1][3] + r[2] * m[2][3]);
    return result;
}

Transform operator*(const Transform& a, const Transform& b) {
    Transform product;
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 4; ++j) {
            product.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
        }
        product.m[i][3] += a.m[i][3];
    }
    return product;
}

}  // namespace vlx::render
