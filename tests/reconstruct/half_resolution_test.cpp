#include "reconstruct/drift/half_resolution.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "reconstruct/drift/finishing.h"
#include "variolux/base/parallel.h"

namespace vlx {
namespace {

constexpr int kSide = 40;
constexpr DataPlanes kData{3};
constexpr CombinedPlanes kCombined{3};

PixelRows pixelRows(int width, int height, int features) {
    return {RowRing(width, kData.channels(), height), RowRing(width, SquaresPlanes::kChannels, height),
            RowRing(width, FeaturePlanes{features}.rawChannels(), height)};
}

TEST(HalveRow, MeansStayThoseOfTheSamePixelsAndCountsTellTheirVariance) {
    PixelRows fine = pixelRows(3, 3, 1), coarse = pixelRows(2, 2, 1);
    const float counts[3][3] = {{2, 4, 1}, {0, 4, 0}, {1, 1, 8}};
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x) {
            fine.data.row(kData.halfCount(0), y)[x] = counts[y][x];
            fine.data.row(kData.halfCount(1), y)[x] = 1;
            fine.data.row(kData.stated(), y)[x] = x < 2 ? 1 : 0;
            for (int c = 0; c < 3; ++c) {
                fine.data.row(kData.mean(0) + c, y)[x] = static_cast<float>(10 * y + x);
                fine.data.row(kData.mean(1) + c, y)[x] = 5;
            }
            for (int k = 0; k < SquaresPlanes::kChannels; ++k)
                fine.squares.row(k, y)[x] = static_cast<float>(k + 1);
            fine.raw.row(0, y)[x] = static_cast<float>(x);
            fine.raw.row(1, y)[x] = 0.5f;
        }
    for (int y = 0; y < 2; ++y) halveRow(fine, 3, 3, 3, 1, y, coarse);
    // Three of the four pixels have data of half A: their mean's variance is v (1/2 + 1/4 + 1/4) / 9.
    EXPECT_FLOAT_EQ(coarse.data.row(kData.halfCount(0), 0)[0], 9);
    EXPECT_FLOAT_EQ(coarse.data.row(kData.mean(0), 0)[0], (0 + 1 + 11) / 3.f);
    EXPECT_FLOAT_EQ(coarse.data.row(kData.halfCount(1), 0)[0], 4);
    EXPECT_FLOAT_EQ(coarse.data.row(kData.count(), 0)[0], 13);
    EXPECT_FLOAT_EQ(coarse.data.row(kData.stated(), 0)[0], 1);
    EXPECT_FLOAT_EQ(coarse.squares.row(2, 0)[0], 12);
    EXPECT_FLOAT_EQ(coarse.raw.row(0, 0)[0], 0.5f);
    EXPECT_FLOAT_EQ(coarse.raw.row(1, 0)[0], 0.125f);
    // At the border fewer pixels are one.
    EXPECT_FLOAT_EQ(coarse.data.row(kData.halfCount(0), 0)[1], 1);
    EXPECT_FLOAT_EQ(coarse.data.row(kData.mean(0), 0)[1], 2);
    EXPECT_FLOAT_EQ(coarse.data.row(kData.mean(0), 1)[1], 22);
    EXPECT_FLOAT_EQ(coarse.data.row(kData.stated(), 1)[1], 0);
    EXPECT_FLOAT_EQ(coarse.raw.row(1, 1)[1], 0.5f);
}

/// The rings of a level, to be filled by hand.
struct MadeUpLevel {
    MadeUpLevel(int pixels, int radiance = 3)
        : side(pixels),
          data(pixels, DataPlanes{radiance}.channels(), pixels),
          features(pixels, 0, pixels),
          variances(pixels, 3, pixels),
          combined(pixels, CombinedPlanes{radiance}.channels(), pixels) {}
    LevelRows rows() const { return {side, side, data, features, variances, combined}; }
    void set(RowRing& ring, int plane, float value) const {
        for (int y = 0; y < side; ++y) std::fill_n(ring.row(plane, y), side, value);
    }
    int side;
    RowRing data, features, variances, combined;
};

/// The mean squared error of the corrected estimate, where K has errors of standard deviation `fineError`
/// that blocks of 2 x 2 pixels share, and C of `coarseError`; data have variance 1 a half.
double correctedError(double fineError, double coarseError) {
    MadeUpLevel fine(kSide), coarse(kSide / 2);
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    const double truth = 5;
    for (int y = 0; y < kSide / 2; ++y)
        for (int x = 0; x < kSide / 2; ++x)
            for (int half = 0; half < 2; ++half) {
                const double ofFine = fineError * normal(random), ofCoarse = coarseError * normal(random);
                for (int c = 0; c < 3; ++c) {
                    coarse.combined.row(kCombined.half(half) + c, y)[x] =
                        static_cast<float>(truth + ofCoarse);
                    coarse.combined.row(kCombined.value() + c, y)[x] +=
                        static_cast<float>((truth + ofCoarse) / 2);
                    for (int i = 0; i < 4; ++i) {
                        const int row = 2 * y + i / 2, col = 2 * x + i % 2;
                        fine.combined.row(kCombined.half(half) + c, row)[col] =
                            static_cast<float>(truth + ofFine);
                        fine.combined.row(kCombined.value() + c, row)[col] +=
                            static_cast<float>((truth + ofFine) / 2);
                        fine.data.row(kData.mean(half) + c, row)[col] =
                            static_cast<float>(truth + normal(random));
                        fine.data.row(kData.halfCount(half), row)[col] = 1;
                        fine.data.row(kData.count(), row)[col] = 2;
                        fine.variances.row(c, row)[col] = 1;
                    }
                }
            }
    RowRing differences(kSide, DifferencePlanes{}.channels(), kSide),
        corrected(kSide, kCombined.channels(), kSide);
    Correction correction(3, fine.rows(), coarse.rows(), differences, corrected);
    for (int y = 0; y < kSide; ++y) correction.differenceRow(y);
    for (int y = 0; y < kSide; ++y) correction.correctRow(y);
    double sum = 0;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const double d = static_cast<double>(corrected.row(kCombined.value(), y)[x]) - truth;
            sum += d * d / (kSide * kSide);
        }
    return sum;
}

TEST(Correction, TakesWhatTheCoarseLevelKnowsBetter) {
    // Of errors of variance 1/2 (mean of two halves), what bilinear interpolation does not carry up stays.
    EXPECT_LT(correctedError(1, 0), 0.2);
}

TEST(Correction, RefusesACoarseLevelThatIsWorse) {
    // A plain average would leave a quarter of 9/2, less what interpolation smooths.
    EXPECT_LT(correctedError(0, 3), 0.06);
}

TEST(Correction, WhereBothAreRightChangesNothing) { EXPECT_LT(correctedError(0, 0), 1e-12); }

class FinishingTest : public testing::Test {
  protected:
    FinishingTest()
        : level_(kSide, 4),
          clean_(kSide, CleanPlanes{4}.channels(), kSide),
          light_(kSide, LightPlanes::kChannels, kSide),
          common_(kSide, CommonErrorPlanes::kChannels, kSide) {
        layout_.names = {"R", "G", "B", "key.R"};
        layout_.radiance = 4;
        for (int c = 0; c < 4; ++c) {
            level_.set(level_.combined, planes_.value() + c, c == 3 ? 0.5f : 1.f);
            level_.set(level_.data, data_.mean(0) + c, 1);
            level_.set(level_.data, data_.mean(1) + c, 1);
        }
        for (const int plane : {data_.halfCount(0), data_.halfCount(1)}) level_.set(level_.data, plane, 4);
        level_.set(level_.data, data_.count(), 8);
    }
    void finish() {
        Finishing finishing(layout_, options_, picture_, level_.rows(), level_.combined, clean_, light_,
                            common_);
        for (int y = 0; y < kSide; ++y) finishing.cleanRow(y);
        for (int y = 0; y < kSide; ++y) finishing.errorRow(y);
        image_.resize(static_cast<std::size_t>(kSide) * kSide * 7);
        counts_ = {};
        for (int y = 0; y < kSide; ++y) {
            const auto row = finishing.outputRow(y, image_.data() + static_cast<std::size_t>(y) * kSide * 7);
            counts_.moved += row.moved;
            counts_.image += row.image;
        }
    }
    float value(int c, int x, int y) const {
        return image_[static_cast<std::size_t>((y * kSide + x) * 7 + c)];
    }
    /// A pixel that is three times as bright as all others, `leverage` of it its own samples' mean.
    void addOutlier(float leverage, float variance) {
        for (int c = 0; c < 4; ++c) level_.combined.row(planes_.value() + c, 20)[20] *= 3;
        level_.combined.row(planes_.leverage(), 20)[20] = leverage;
        for (int c = 0; c < 3; ++c) level_.set(level_.variances, c, variance);
    }

    DataPlanes data_{4};
    CombinedPlanes planes_{4};
    Drift options_;
    SampleLayout layout_;
    PictureScale picture_;
    MadeUpLevel level_;
    RowRing clean_, light_, common_;
    std::vector<float> image_;
    Finishing::Counts counts_;
};

TEST_F(FinishingTest, AnOutlierThatItsNoiseExplainsMovesToItsNeighbours) {
    addOutlier(1, 1000);
    finish();
    for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(value(c, 20, 20), 1);
    EXPECT_FLOAT_EQ(value(3, 20, 20), 0.5f);
}

TEST_F(FinishingTest, AnOutlierThatItsSamplesProveStays) {
    addOutlier(1, 0.01f);
    finish();
    // beyond^2 = 3 * 2^2; the noise of three means of 8 samples 3 * 0.01 / 8.
    EXPECT_NEAR(value(0, 20, 20), 3 - 2 * (0.01 / 8) / 4, 1e-6);
    addOutlier(0, 1000);  // and one that its own samples have no part in
    finish();
    EXPECT_GT(value(0, 20, 20), 3);
}

TEST_F(FinishingTest, PartsOfLightMoveByTheSameWeights) {
    addOutlier(1, 16);  // variance of the mean 2 of each, beyond^2 4: half of the way
    finish();
    EXPECT_FLOAT_EQ(value(0, 20, 20), 2);
    EXPECT_FLOAT_EQ(value(3, 20, 20), 1);
}

TEST_F(FinishingTest, LightThatManyPixelsLostComesBack) {
    for (int c = 0; c < 3; ++c) {
        level_.set(level_.data, data_.removed() + c, 0.1f);
        level_.set(level_.combined, planes_.variance() + c, 0.04f);
    }
    finish();
    for (const auto& [x, y] : {std::pair{20, 20}, {0, 0}, {39, 5}}) {
        EXPECT_NEAR(value(1, x, y), 1.1, 0.002) << x;   // 1 in 100 effective pixels at the corner
        EXPECT_NEAR(value(3, x, y), 0.55, 0.001) << x;  // a part of R by R's share
        // What moved is not known better than that it moved; what was lost, to as many samples as lost it.
        EXPECT_NEAR(value(4, x, y), std::sqrt(0.04 + 0.01), 0.002) << x;
    }
    EXPECT_NEAR(counts_.moved, 0.1 * 8 * kSide * kSide, 0.001 * 8 * kSide * kSide);
    EXPECT_NEAR(counts_.image, 1.1 * 8 * kSide * kSide, 0.001 * 8 * kSide * kSide);
}

TEST_F(FinishingTest, LightThatOnePixelLostIsNoKnowledge) {
    for (int c = 0; c < 3; ++c) {
        level_.data.row(data_.removed() + c, 20)[20] = 100;
        level_.set(level_.combined, planes_.variance() + c, 0.04f);
    }
    finish();
    EXPECT_NEAR(value(0, 21, 20), 1, 1e-4);
    EXPECT_LT(counts_.moved, 1e-1);  // of 100 samples' worth
}

TEST_F(FinishingTest, NoPixelTakesMoreLightThanItsDeviation) {
    for (int c = 0; c < 3; ++c) {
        for (const int half : {0, 1}) level_.set(level_.data, data_.mean(half) + c, 100);
        level_.set(level_.combined, planes_.variance() + c, 0.04f);
        level_.combined.row(planes_.variance() + c, 20)[20] = 0;
        level_.combined.row(planes_.variance() + c, 20)[10] = 4;
    }
    finish();
    EXPECT_NEAR(value(0, 5, 5), 1.2, 1e-6);
    EXPECT_EQ(value(0, 20, 20), 1);          // what is known takes none
    EXPECT_NEAR(value(0, 10, 20), 2, 1e-6);  // and none more than it has
}

}  // namespace
}  // namespace vlx
