#include <gtest/gtest.h>

#include <random>

#include "../base/temporary_folder.h"
#include "reconstruct/common/rebin.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/writer.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {
namespace {

TEST(AverageReplicates, GivesOneSampleAReplicate) {
    const SampleBand band{
        0, 0, 2, 1, {0, 4, 5}, {"R", "sample.replicate"}, {{1, 2, 3, 6, 7}, {1, 0, 1, 0, 2}}};
    const SampleBand means = averageReplicates(band, 1);
    EXPECT_EQ(means.offsets, (std::vector<std::uint64_t>{0, 2, 3}));
    EXPECT_EQ(means.values[0], (std::vector<float>{4, 2, 7}));
    EXPECT_EQ(means.values[1], (std::vector<float>{0, 1, 2}));
}

TEST(ReplicatesThatShareLight, TheErrorMapHoldsTheVarianceOfSplats) {
    // Samples of deviation 0.2, 4 in each of 16 replicates, and splats of deviation 0.5 a replicate:
    // variance of a mean 0.04 / 64 + 0.25 / 16. Taken as independent they would give a quarter of the latter.
    constexpr int kSide = 32, kReplicates = 16, kEach = 4;
    const TemporaryFolder folder;
    DumpHeader header;
    header.data = header.display = {0, 0, kSide, kSide};
    header.channels = {{"R"}, {"G"}, {"B"}, {"sample.replicate", ChannelType::Uint}};
    header.splatReplicates = kReplicates;
    header.replicatesShare = true;
    std::mt19937 random(3);
    std::normal_distribution<float> noise(0, 0.2f), light(1, 0.5f);
    SampleBand band{0, 0, kSide, kSide, {0}, {"R", "G", "B", "sample.replicate"}, {{}, {}, {}, {}}};
    SplatImages splats(header.data, kReplicates);
    for (int p = 0; p < kSide * kSide; ++p) {
        for (int r = 0; r < kReplicates; ++r) {
            for (int c = 0; c < 3; ++c) splats.at(p % kSide, p / kSide, r, c) = light(random);
            for (int i = 0; i < kEach; ++i) {
                for (std::size_t c = 0; c < 3; ++c) band.values[c].push_back(3 + noise(random));
                band.values[3].push_back(static_cast<float>(r));
            }
        }
        band.offsets.push_back(band.values[0].size());
    }
    DumpWriter writer(folder / "a.exr", header);
    writer.write(std::move(band));
    writer.writeSplats(std::move(splats));
    writer.close();

    const DumpReader dump(folder / "a.exr");
    const Reconstruction mean = reconstruct(dump, Mean{});
    double variance = 0, squares = 0;
    for (int p = 0; p < kSide * kSide; ++p) {
        const float* v = mean.image.at(p % kSide, p / kSide);
        for (int c = 0; c < 3; ++c) {
            squares += std::pow(static_cast<double>(v[c]) - 4, 2) / (3 * kSide * kSide);
            variance += std::pow(static_cast<double>(v[3 + c]), 2) / (3 * kSide * kSide);
        }
    }
    const double expected = 0.04 / 64 + 0.25 / 16;
    // 3072 pixels' estimates of relative deviation sqrt(2 / 15): 1 %; their errors: sqrt(2 / 3072), 2.6 %.
    EXPECT_NEAR(variance / expected, 1, 0.04);
    EXPECT_NEAR(squares / expected, 1, 0.11);

    // Kriged like the independent samples that the replicates' means are.
    header.splatReplicates = 0;
    header.replicatesShare = false;
    DumpWriter independent(folder / "b.exr", header);
    independent.write(averageReplicates(dump.read(0, kSide, {"R", "G", "B", "sample.replicate"}), 3));
    independent.close();
    const Reconstruction shared = reconstruct(dump, Drift{});
    const Reconstruction plain = reconstruct(DumpReader(folder / "b.exr"), Drift{});
    for (int p = 0; p < kSide * kSide; ++p)
        for (int c = 0; c < 6; ++c)
            ASSERT_EQ(shared.image.at(p % kSide, p / kSide)[c], plain.image.at(p % kSide, p / kSide)[c]);
}

}  // namespace
}  // namespace vlx
