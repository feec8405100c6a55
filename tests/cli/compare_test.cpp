#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/base/image_io.h"
#include "variolux/compare/metrics.h"

namespace vlx {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// A folder with a reference of 40 x 30 pixels and images that are brighter by a constant.
class CompareTool : public testing::Test {
  protected:
    CompareTool() {
        Image image(Window{10, 20, 40, 30}, {"R", "G", "B"});
        for (std::size_t i = 0; i < image.pixels.size(); ++i)
            image.pixels[i] = 0.25f + 0.001f * static_cast<float>(i % 300);
        reference_ = image;
        writeImage(ref_, image);
        writeImage(good_, brighter(0.01f));
        writeImage(bad_, brighter(0.1f));
    }

    Image brighter(float by) const {
        Image image = reference_;
        for (float& pixel : image.pixels) pixel += by;
        return image;
    }

    static ToolRun run(const std::vector<std::string>& arguments) {
        return runTool("vlx-compare", arguments);
    }

    const TemporaryFolder folder_;
    const std::string ref_ = folder_ / "reference.exr";
    const std::string good_ = folder_ / "good.exr";
    const std::string bad_ = folder_ / "bad.exr";
    Image reference_;
};

TEST_F(CompareTool, PrintsATableWithTheBestValueMarked) {
    const ToolRun result = run({ref_, bad_, good_});
    EXPECT_EQ(result.exitCode, 0) << result.err;
    EXPECT_EQ(result.err, "");
    EXPECT_NE(result.out.find("40 x 30"), std::string::npos);
    std::istringstream lines(result.out);
    int rows = 0;
    for (std::string line; std::getline(lines, line);)
        for (const char* title : {"RMSE  ", "relMSE  ", "PSNR", "SSIM", "MAPE", "bias"})
            if (line.starts_with(title)) {
                // good.exr is the last column, and better in every row.
                EXPECT_TRUE(line.ends_with(" *")) << line;
                EXPECT_EQ(std::count(line.begin(), line.end(), '*'), 1) << line;
                ++rows;
            }
    EXPECT_EQ(rows, 6) << result.out;
}

TEST_F(CompareTool, JsonHoldsTheLibrarysNumbers) {
    const ToolRun result = run({ref_, good_, bad_, "--json"});
    ASSERT_EQ(result.exitCode, 0) << result.err;
    const Json json = Json::parse(result.out);
    EXPECT_EQ(json["reference"]["path"], ref_);
    EXPECT_EQ(json["reference"]["window"], Json({10, 20, 40, 30}));
    ASSERT_EQ(json["images"].size(), 2u);
    const Comparison expected = compareColour(reference_, brighter(0.1f));
    for (const MetricInfo& info : metricInfos())
        EXPECT_DOUBLE_EQ(json["images"][1]["metrics"][std::string(info.name)].get<double>(),
                         expected[info.metric])
            << info.name;
    EXPECT_EQ(json["images"][1]["name"], "bad");
    EXPECT_TRUE(json["violations"].empty());
}

TEST_F(CompareTool, JsonHoldsNoNonFiniteNumbers) {
    Image broken = brighter(0.01f);
    for (float& pixel : broken.pixels) pixel = std::numeric_limits<float>::quiet_NaN();
    writeImage(folder_ / "nan.exr", broken);
    const ToolRun result = run({ref_, ref_, folder_ / "nan.exr", "--json"});
    ASSERT_EQ(result.exitCode, 0) << result.err;
    const Json json = Json::parse(result.out);
    EXPECT_TRUE(json["images"][0]["metrics"]["psnr"].is_null());  // infinite: the images are equal
    EXPECT_EQ(json["images"][0]["metrics"]["mse"], 0.0);
    EXPECT_TRUE(json["images"][1]["metrics"]["mse"].is_null());
    EXPECT_EQ(json["images"][1]["metrics"]["nonfinite"], 1200);
    EXPECT_EQ(json["images"][1]["excluded"], 1200);
}

TEST_F(CompareTool, TableSaysWhatWasExcluded) {
    Image broken = brighter(0.01f);
    broken.pixels[7] = std::numeric_limits<float>::infinity();
    writeImage(folder_ / "inf.exr", broken);
    const ToolRun result = run({ref_, folder_ / "inf.exr"});
    EXPECT_EQ(result.exitCode, 0);
    EXPECT_NE(result.out.find("1 of 1200 pixels"), std::string::npos) << result.out;
}

TEST_F(CompareTool, PassedLimitsEndWithThreeAndSayWhich) {
    const ToolRun result = run({ref_, good_, bad_, "--json", "--fail-above", "rmse=0.05", "--fail-above",
                                "bias=0.05", "--fail-below", "ssim=0.5", "--fail-above", "nonfinite=0"});
    EXPECT_EQ(result.exitCode, 3);
    EXPECT_NE(result.err.find("bad.exr: rmse is 0.1, the limit is 0.05"), std::string::npos) << result.err;
    EXPECT_EQ(result.err.find("good.exr"), std::string::npos) << result.err;
    const Json violations = Json::parse(result.out)["violations"];
    ASSERT_EQ(violations.size(), 2u);
    EXPECT_EQ(violations[0]["metric"], "rmse");
    EXPECT_EQ(violations[1]["metric"], "bias");

    EXPECT_EQ(run({ref_, good_, bad_, "--fail-above", "rmse=0.2"}).exitCode, 0);
    EXPECT_EQ(run({ref_, good_, "--fail-below", "psnr=60"}).exitCode, 3);
}

TEST_F(CompareTool, AMetricThatIsNoNumberPassesEveryLimit) {
    Image broken = reference_;
    for (float& pixel : broken.pixels) pixel = std::numeric_limits<float>::quiet_NaN();
    writeImage(folder_ / "nan.exr", broken);
    EXPECT_EQ(run({ref_, folder_ / "nan.exr", "--fail-above", "mse=1e9"}).exitCode, 3);
    EXPECT_EQ(run({ref_, folder_ / "nan.exr", "--fail-below", "ssim=-1"}).exitCode, 3);
}

TEST_F(CompareTool, WritesPicturesWithCropsOnlyWhenAskedFor) {
    const std::string out = folder_ / "new/pictures";
    ASSERT_EQ(run({ref_, good_, bad_, "--pictures", out, "--exposure", "0.5"}).exitCode, 0);
    for (const char* name : {"side_by_side.png", "signed_error.png", "relative_error.png"})
        EXPECT_GT(readImage(out + "/" + name).data.pixels(), 0) << name;
    EXPECT_FALSE(fs::exists(out + "/crops.png"));
    ASSERT_EQ(run({ref_, good_, "--pictures", out, "--crop", "10,20,8,8", "--crop", "42,42,8,8"}).exitCode,
              0);
    EXPECT_TRUE(fs::exists(out + "/crops.png"));
}

// As the other tools' outputs: what is finished is left alone, anything else is made anew.
TEST_F(CompareTool, FinishedPicturesAreNotWrittenAgain) {
    const std::string out = folder_ / "pictures";
    const std::string picture = out + "/signed_error.png";
    const auto write = [&](std::vector<std::string> more) {
        std::vector<std::string> arguments = {ref_, good_, "--pictures", out};
        arguments.insert(arguments.end(), more.begin(), more.end());
        fs::last_write_time(picture, fs::file_time_type() + std::chrono::hours(1));
        const auto before = fs::last_write_time(picture);
        const ToolRun result = run(arguments);
        EXPECT_EQ(result.exitCode, 0) << result.err;
        EXPECT_NE(result.out.find("relMSE"), std::string::npos) << result.out;
        EXPECT_EQ(result.err.find("is finished") == std::string::npos,
                  fs::last_write_time(picture) != before);
        return fs::last_write_time(picture) != before;
    };
    fs::create_directory(out);
    std::ofstream(picture) << "something else";
    EXPECT_TRUE(write({}));
    EXPECT_FALSE(write({}));
    EXPECT_FALSE(write({"--threads", "1", "--fail-above", "mse=9"})) << "they do not change the pictures";
    EXPECT_TRUE(write({"--overwrite"}));
    EXPECT_FALSE(write({}));
    EXPECT_TRUE(write({"--exposure", "1"}));
    EXPECT_TRUE(write({"--exposure", "1", "--crop", "10,20,8,8"})) << "crops.png is missing";
    EXPECT_FALSE(write({"--exposure", "1", "--crop", "10,20,8,8"}));
    EXPECT_TRUE(write({}));
    fs::remove(out + "/side_by_side.png");
    EXPECT_TRUE(write({}));
    writeImage(good_, readImage(bad_));
    EXPECT_TRUE(write({})) << "another image of this name";
    EXPECT_EQ(run({ref_, good_, "--overwrite"}).exitCode, 2);
}

TEST_F(CompareTool, PicturesAreNotWrittenOverInputs) {
    const std::string input = folder_ / "signed_error.png";
    Image image({0, 0, 8, 8}, {"R", "G", "B"});
    writeImage(input, image);
    const auto bytes = fs::file_size(input);
    const ToolRun refused = run({input, input, "--pictures", folder_ / "."});
    EXPECT_EQ(refused.exitCode, 2);
    EXPECT_NE(refused.err.find("--pictures: expected another file than the input"), std::string::npos)
        << refused.err;
    EXPECT_EQ(fs::file_size(input), bytes);
}

TEST_F(CompareTool, LayersAndStandardDeviations) {
    Image image(reference_.data,
                {"light.R", "light.G", "light.B", "stddev.R", "stddev.G", "stddev.B", "R", "G", "B"});
    for (int row = 0; row < 30; ++row)
        for (int col = 0; col < 40; ++col)
            for (int c = 0; c < 3; ++c) {
                image.at(col, row)[c] = reference_.at(col, row)[c] + 0.5f;
                image.at(col, row)[3 + c] = col < 10 ? 0.2f : 0.07f;
                image.at(col, row)[6 + c] = reference_.at(col, row)[c] + 0.1f;
            }
    writeImage(folder_ / "layers.exr", image);
    Json json = Json::parse(run({ref_, folder_ / "layers.exr", good_, "--json", "--stddev"}).out);
    EXPECT_DOUBLE_EQ(json["images"][0]["calibration"]["within_1_stddev"].get<double>(), 0.25);
    EXPECT_DOUBLE_EQ(json["images"][0]["calibration"]["within_2_stddev"].get<double>(), 1.0);
    EXPECT_FALSE(json["images"][1].contains("calibration"));
    EXPECT_NEAR(json["images"][0]["metrics"]["rmse"].get<double>(), 0.1, 1e-6);
    EXPECT_EQ(json["images"][0]["channels"], Json({"R", "G", "B"}));

    json = Json::parse(run({ref_, folder_ / "layers.exr", "--json", "--layer", "light"}).out);
    EXPECT_NEAR(json["images"][0]["metrics"]["rmse"].get<double>(), 0.5, 1e-6);
    EXPECT_EQ(json["images"][0]["channels"], Json({"light.R", "light.G", "light.B"}));
    EXPECT_EQ(json["reference"]["channels"], Json({"R", "G", "B"}));

    // The reference's own variance joins the image's.
    json = Json::parse(
        run({folder_ / "layers.exr", folder_ / "layers.exr", "--json", "--stddev", "--reference-stddev"})
            .out);
    EXPECT_NEAR(json["images"][0]["calibration"]["predicted_rmse"].get<double>(),
                std::sqrt(2 * (0.25 * 0.04 + 0.75 * 0.0049)), 1e-6);

    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{ref_, good_, "--stddev"},
          {ref_, good_, "--layer", "nosuch"},
          {ref_, folder_ / "layers.exr", "--stddev", "--reference-stddev"}}) {
        const ToolRun result = run(arguments);
        EXPECT_EQ(result.exitCode, 1) << result.out;
        EXPECT_EQ(result.out, "");
        EXPECT_NE(result.err, "");
    }
}

/// What Blender writes, kriged: the picture and its error among other layers.
Image layersOf(const Image& picture) {
    std::vector<std::string> names;
    for (const char* layer :
         {"Composite.Combined", "V.Combined", "V.Depth", "V.key", "V.stddev", "W.Combined"})
        for (const char* c : {"R", "G", "B"}) names.push_back(std::string(layer) + "." + c);
    Image image(picture.data, names);
    for (int row = 0; row < picture.data.height; ++row)
        for (int col = 0; col < picture.data.width; ++col)
            for (int i = 0; i < image.channelCount(); ++i)
                image.at(col, row)[i] =
                    i / 3 == 4
                        ? 0.05f
                        : picture.at(col, row)[i % 3] + 0.1f * static_cast<float>(i / 3 == 1 ? 0 : i / 3 + 1);
    return image;
}

TEST_F(CompareTool, BlendersFilesAreComparedByTheirCombined) {
    const std::string layers = folder_ / "layers.exr", brighter = folder_ / "brighter.exr";
    Image image = layersOf(reference_);
    writeImage(layers, image);
    for (float& pixel : image.pixels) pixel += 0.01f;
    writeImage(brighter, image);
    Json json = Json::parse(run({layers, brighter, good_, "--json", "--stddev", "--reference-stddev"}).out);
    EXPECT_EQ(json["reference"]["channels"], Json({"V.Combined.R", "V.Combined.G", "V.Combined.B"}));
    for (const Json& of : json["images"]) EXPECT_NEAR(of["metrics"]["rmse"].get<double>(), 0.01, 1e-6);
    EXPECT_NEAR(json["images"][0]["calibration"]["predicted_rmse"].get<double>(), std::hypot(0.05, 0.06),
                1e-6);
    EXPECT_FALSE(json["images"][1].contains("calibration"));

    json = Json::parse(run({ref_, layers, "--json", "--layer", "W"}).out);
    EXPECT_EQ(json["images"][0]["channels"], Json({"W.Combined.R", "W.Combined.G", "W.Combined.B"}));
    EXPECT_NEAR(json["images"][0]["metrics"]["rmse"].get<double>(), 0.6, 1e-6);
    json = Json::parse(run({ref_, layers, "--json", "--layer", "V.key"}).out);
    EXPECT_NEAR(json["images"][0]["metrics"]["rmse"].get<double>(), 0.4, 1e-6);
}

TEST_F(CompareTool, WhereNothingIsFoundTheLayersAreListed) {
    writeImage(folder_ / "layers.exr", layersOf(reference_));
    const ToolRun none = run({ref_, folder_ / "layers.exr", "--layer", "X"});
    EXPECT_EQ(none.exitCode, 1);
    EXPECT_NE(
        none.err.find("found the layers R, G, B, Composite.Combined, V.Combined, V.Depth, V.key, V.stddev, "
                      "W.Combined"),
        std::string::npos)
        << none.err;
    EXPECT_EQ(none.err.find("V.key.R"), std::string::npos);
    Image passes(reference_.data, {"V.Normal.X", "V.Normal.Y", "V.Normal.Z", "V.Depth.Z"});
    writeImage(folder_ / "passes.exr", passes);
    const ToolRun missing = run({ref_, folder_ / "passes.exr"});
    EXPECT_EQ(missing.exitCode, 1);
    EXPECT_NE(missing.err.find("passes.exr: expected channels R, G, B"), std::string::npos) << missing.err;
    EXPECT_NE(missing.err.find("(--layer NAME names one), found the layers V.Depth, V.Normal"),
              std::string::npos);
}

TEST_F(CompareTool, BadUsageIsTwoAndEachOptionMissesItsValue) {
    for (const char* option :
         {"--layer", "--pictures", "--crop", "--exposure", "--fail-above", "--fail-below", "--threads"}) {
        const ToolRun result = run({ref_, good_, option});
        EXPECT_EQ(result.exitCode, 2) << option;
        EXPECT_NE(result.err.find(option), std::string::npos) << result.err;
        EXPECT_EQ(result.out, "");
    }
    const std::string out = folder_ / "out";
    const std::vector<std::vector<std::string>> bad = {
        {},
        {ref_},
        {ref_, good_, "--nosuch"},
        {ref_, good_, "--fail-above", "nosuch=1"},
        {ref_, good_, "--fail-above", "psnr=30"},
        {ref_, good_, "--fail-below", "mse=1"},
        {ref_, good_, "--fail-above", "mse=1x"},
        {ref_, good_, "--crop", "1,1,4,4"},  // no --pictures
        {ref_, good_, "--pictures", out, "--crop", "1,1,4"},
        {ref_, good_, "--pictures", out, "--exposure", "99"},
        {ref_, good_, "--reference-stddev"},
        {ref_, good_, "--threads", "-1"},
    };
    for (const auto& arguments : bad) {
        const ToolRun result = run(arguments);
        EXPECT_EQ(result.exitCode, 2) << testing::PrintToString(arguments);
        EXPECT_NE(result.err.find("--help"), std::string::npos) << result.err;
    }
    EXPECT_FALSE(fs::exists(out));
}

TEST_F(CompareTool, BadFilesAreOneWithAMessageAndNoOutput) {
    std::ofstream(folder_ / "text.exr") << "no image";
    const std::string whole = contentsOf(good_);
    std::ofstream(folder_ / "short.exr", std::ios::binary) << whole.substr(0, whole.size() / 2);
    Image moved = reference_;
    moved.data.x += 1;
    writeImage(folder_ / "moved.exr", moved);
    writeImage(folder_ / "small.exr", Image(Window{10, 20, 40, 29}, {"R", "G", "B"}));
    writeImage(folder_ / "normals.exr", Image(reference_.data, {"N.X", "N.Y", "N.Z"}));
    const std::string out = folder_ / "out";
    for (const std::string name :
         {"missing.exr", "text.exr", "short.exr", "moved.exr", "small.exr", "normals.exr"}) {
        const ToolRun result = run({ref_, good_, folder_ / name, "--json", "--pictures", out});
        EXPECT_EQ(result.exitCode, 1) << name;
        EXPECT_NE(result.err.find(name), std::string::npos) << result.err;
        EXPECT_EQ(result.out, "") << name;
        EXPECT_FALSE(fs::exists(out)) << name;
    }
    const std::string windows = run({ref_, folder_ / "small.exr"}).err;
    EXPECT_NE(windows.find("40 x 30 pixels at (10, 20)"), std::string::npos) << windows;
    EXPECT_NE(windows.find("40 x 29 pixels at (10, 20)"), std::string::npos) << windows;

    // A crop outside of the image; a folder that cannot be made; a disk that is full.
    EXPECT_EQ(run({ref_, good_, "--pictures", out, "--crop", "0,0,4,4"}).exitCode, 1);
    EXPECT_EQ(run({ref_, good_, "--pictures", out, "--crop", "49,20,2,2"}).exitCode, 1);
    EXPECT_FALSE(fs::exists(out));
    EXPECT_EQ(run({ref_, good_, "--pictures", good_}).exitCode, 1);
    const ToolRun full = runTool("vlx-compare", {ref_, good_, "--pictures", out}, {.fileSizeLimit = 1000});
    EXPECT_EQ(full.exitCode, 1);
    EXPECT_EQ(full.out, "");
    EXPECT_NE(full.err.find("side_by_side.png"), std::string::npos) << full.err;
    EXPECT_TRUE(fs::is_empty(out));
}

TEST_F(CompareTool, SameTextForAnyNumberOfThreads) {
    const std::string one = run({ref_, good_, bad_, "--json", "--threads", "1"}).out;
    for (const char* threads : {"2", "8"})
        EXPECT_EQ(run({ref_, good_, bad_, "--json", "--threads", threads}).out, one) << threads;
}

TEST_F(CompareTool, HelpAndVersionAreZero) {
    const ToolRun help = run({"--help"});
    EXPECT_EQ(help.exitCode, 0);
    std::istringstream lines(help.out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
    for (const MetricInfo& info : metricInfos())
        EXPECT_NE(help.out.find("\n  " + std::string(info.name) + " "), std::string::npos) << info.name;
    const ToolRun version = run({"--version"});
    EXPECT_EQ(version.exitCode, 0);
    EXPECT_TRUE(version.out.starts_with("Variolux ")) << version.out;
}

}  // namespace
}  // namespace vlx
