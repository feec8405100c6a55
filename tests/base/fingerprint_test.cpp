#include "variolux/base/fingerprint.h"

#include <gtest/gtest.h>

#include <fstream>

#include "temporary_folder.h"
#include "variolux/base/error.h"
#include "variolux/base/hash.h"
#include "variolux/base/image_io.h"
#include "variolux/base/text.h"

namespace vlx {
namespace {

// Published test values of XXH64 with seed 0.
TEST(ContentHash, IsXxh64HoweverTheBytesAreCut) {
    EXPECT_EQ(hexText(ContentHash().value()), "ef46db3751d8e999");
    const std::string text = "xxhash";
    for (std::size_t cut = 0; cut <= text.size(); ++cut) {
        ContentHash hash;
        hash.add(std::as_bytes(std::span(text).first(cut)));
        hash.add(std::as_bytes(std::span(text).subspan(cut)));
        EXPECT_EQ(hexText(hash.value()), "32dd38952c4bc720") << cut;
    }
}

TEST(Fingerprint, TellsNamesValuesAndTheirOrder) {
    const std::string one = Fingerprint().add("spp", "16").add("seed", "1").text();
    EXPECT_EQ(one.size(), 16u);
    EXPECT_EQ(Fingerprint().add("spp", "16").add("seed", "1").text(), one);
    EXPECT_NE(Fingerprint().add("seed", "1").add("spp", "16").text(), one);
    EXPECT_NE(Fingerprint().add("spp", "1").add("seed", "16").text(), one);
    EXPECT_NE(Fingerprint().add("spp", "16seed=1").text(), one);
}

TEST(Fingerprint, OfFilesIsOfTheirContents) {
    const TemporaryFolder folder;
    std::ofstream(folder / "a") << "some samples";
    std::ofstream(folder / "b") << "some samples";
    std::ofstream(folder / "c") << "other samples";
    EXPECT_EQ(Fingerprint().addFile(folder / "a").text(), Fingerprint().addFile(folder / "b").text());
    EXPECT_NE(Fingerprint().addFile(folder / "a").text(), Fingerprint().addFile(folder / "c").text());
    EXPECT_EQ(Fingerprint().addFile("").text(), Fingerprint().text()) << "no file";
    EXPECT_EQ(fileFingerprint(folder / "a"), fileFingerprint(folder / "b"));
    EXPECT_THROW(fileFingerprint(folder / "none"), Error);
    EXPECT_THROW(fileFingerprint(folder / "."), Error);
}

TEST(Fingerprint, NoticesFilesThatChangeMeanwhile) {
    const TemporaryFolder folder;
    std::ofstream(folder / "a") << "some samples";
    Fingerprint made;
    made.addFile(folder / "a").addFile(folder / "later");
    EXPECT_NO_THROW(made.checkUnchanged());
    std::ofstream(folder / "a", std::ios::app) << ", and more";
    EXPECT_THROW(made.checkUnchanged(), Error);
}

TEST(Fingerprint, OfABandSaysWhichWholeItBelongsTo) {
    const Fingerprint made = Fingerprint().add("spp", "16");
    EXPECT_EQ(made.text({1, 5}), made.text() + " band 2/5");
    EXPECT_EQ(made.text({1, 5}), inputsOfBand(made.text(), {1, 5}));
    EXPECT_EQ(made.text(), inputsOfBand(made.text(), {}));
    EXPECT_EQ(wholeOfBand(made.text({1, 5})), made.text());
    EXPECT_EQ(wholeOfBand(made.text()), std::nullopt);
    EXPECT_EQ(wholeOfBand(""), std::nullopt);
}

TEST(AreMadeOf, AsksImagesAndOnlyLooksForOtherFiles) {
    const TemporaryFolder folder;
    const Image image(Window{0, 0, 2, 2}, {"R", "G", "B"});
    const std::string made = Fingerprint().add("spp", "16").text();
    ImageWriteOptions options;
    options.attributes[kInputsAttribute] = made;
    for (const std::string name : {"a.exr", "a.png"}) {
        writeImage(folder / name, image, options);
        EXPECT_TRUE(areMadeOf({folder / name}, made)) << name;
        EXPECT_FALSE(areMadeOf({folder / name}, made + " band 1/2")) << name;
        EXPECT_FALSE(areMadeOf({folder / name, folder / "report.json"}, made)) << name;
    }
    std::ofstream(folder / "report.json") << "{}";
    EXPECT_TRUE(areMadeOf({folder / "a.exr", folder / "report.json"}, made));
    writeImage(folder / "a.exr", image);
    EXPECT_FALSE(areMadeOf({folder / "a.exr"}, made)) << "says nothing";
    std::ofstream(folder / "a.exr") << "no image";
    EXPECT_FALSE(areMadeOf({folder / "a.exr"}, made));
}

}  // namespace
}  // namespace vlx
