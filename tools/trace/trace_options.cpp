#include "trace/trace_options.h"

#include <cmath>
#include <limits>

#include "finished.h"
#include "frames.h"
#include "tool_main.h"
#include "variolux/base/hash.h"
#include "variolux/base/text.h"

namespace vlx::render {

void bindOptions(CLI::App& app, TraceOptions& o) {
    o.commandLine = &app;
    app.footer(
        "Examples:\n"
        "  vlx-trace room.glb -o room.exr --width 640 --spp 32\n"
        "  vlx-trace room.glb -o room.exr --hierarchical --tolerance 0.05 --seed 7\n"
        "  vlx-trace house.gltf -o house.exr --env sky.exr --camera kitchen --crop 100,50,64,64\n"
        "  vlx-trace chair.glb -o chair.exr --env-constant 1,1,1 --camera-position 2,1.5,2 --look-at "
        "0,0.5,0\n"
        "  vlx-trace room.glb -o room_####.exr --frames 1-100 --band 2/5\n"
        "The dump is a deep OpenEXR file: its part `beauty` is the plain average, its part `samples` "
        "holds\n"
        "every sample with position, albedo, normal and depth. vlx-krige reconstructs it.");
    app.add_option("SCENE", o.scene, "A glTF 2.0 scene, .glb or .gltf")->required();
    app.add_option("-o,--output", o.dump, "The dump to write (.exr)");
    app.add_option("--camera", o.camera,
                   "Name or number of the camera (default: the scene's active one, or the\n"
                   "first that can be used, or one that is made: the whole scene, from 45 degrees to\n"
                   "the right of its front (+z) and 22.5 up)")
        ->type_name("NAME|INDEX");
    const auto place = [&](const char* name, std::vector<float>& value, const char* help) {
        app.add_option(name, value, help)->delimiter(',')->expected(3)->type_name("X,Y,Z");
    };
    place("--camera-position", o.position,
          "Where the camera stands still, instead of where it is in the file (default of\n"
          "--look-at: the middle of the scene)");
    place("--look-at", o.target, "What is in the middle of the picture; y is up in it");
    app.add_option("--fov", o.verticalDegrees,
                   "The picture's vertical angle of view, in degrees (default: the camera's own; 45\n"
                   "where one is made); makes an orthographic camera a perspective one")
        ->check(finiteWithin(0.01, 179))
        ->type_name("DEGREES");
    app.add_option("--variant", o.variant,
                   "Name or number of the variant of materials (KHR_materials_variants; default:\n"
                   "none, the materials that the scene's meshes name themselves)")
        ->type_name("NAME|INDEX");
    app.add_flag("--list-cameras", o.listCameras, "Print the scene's cameras and exit");
    app.add_option("--width", o.width, "Of the picture, in pixels (default: 512, or from the height)")
        ->check(CLI::Range(1, 1 << 20));
    app.add_option("--height", o.height, "Of the picture (default: from the width, by the camera's aspect)")
        ->check(CLI::Range(1, 1 << 20));
    app.add_option("--crop", o.crop, "Render only this part of the picture")
        ->delimiter(',')
        ->expected(4)
        ->type_name("X,Y,WIDTH,HEIGHT");
    auto* spp = app.add_option("--spp", o.render.spp, "Samples a pixel, the same everywhere")
                    ->check(CLI::Range(1, 1 << 24))
                    ->capture_default_str();
    auto* hierarchical =
        app.add_flag("--hierarchical", o.render.hierarchical,
                     "Sample cells of 4, 2, 1, 1/2, 1/4 pixels in turn, as long as their residual\n"
                     "variance asks for it: 1 to 256 samples a pixel")
            ->excludes(spp);
    app.add_option("--tolerance", o.render.refinement.tolerance,
                   "Hierarchical: the relative standard error of a pixel at which its cells are\n"
                   "no longer refined; 0 takes all 256 samples. Large values darken the image:\n"
                   "cells that have not met rare bright paths stop early")
        ->check(finiteNonNegative())
        ->needs(hierarchical)
        ->capture_default_str();
    auto* time = app.add_option("--time", o.timeLimit,
                                "Take as many samples a pixel as this many seconds of tracing allow,\n"
                                "judged by a short pilot")
                     ->check(finitePositive())
                     ->excludes(spp)
                     ->excludes(hierarchical)
                     ->type_name("SECONDS");
    app.add_option("--target-error", o.targetError,
                   "Take as many samples a pixel as bring the relMSE of the plain average down to\n"
                   "this, judged by a short pilot (before reconstruction)")
        ->check(finitePositive())
        ->excludes(spp)
        ->excludes(hierarchical)
        ->excludes(time)
        ->type_name("RELMSE");
    app.add_option("--append", o.earlierPath,
                   "A dump of the same view: its samples are kept, --spp more are added to\n"
                   "them, and both are written to the output")
        ->excludes(hierarchical)
        ->type_name("DUMP");
    app.add_option("--sample-map", o.mapPath,
                   "Where samples are wanted: an image with a channel sampling.density (or Y),\n"
                   ">= 0, relative to its mean. --spp is then the mean over the picture")
        ->excludes(hierarchical)
        ->type_name("MAP");
    app.add_option("--replicates", o.render.replicates,
                   "Divide the samples of each pixel into this many independent randomisations\n"
                   "(written as sample.replicate). 1: two, samples of even and of odd number")
        ->check(CLI::Range(1, 1 << 24))
        ->excludes(hierarchical)
        ->capture_default_str();
    app.add_option("--seed", o.render.seed, "Another seed, other noise")->capture_default_str();
    app.add_option("--max-bounces", o.render.path.maxBounces, "Scattering events of a path at most")
        ->check(CLI::Range(0, 1 << 16))
        ->capture_default_str();
    auto* constant = app.add_option("--env-constant", o.environmentConstant,
                                    "Radiance from all around, in place of the scene's own environment")
                         ->delimiter(',')
                         ->expected(3)
                         ->check(finiteNonNegative())
                         ->type_name("R,G,B");
    app.add_option("--env", o.environment.image,
                   "Latitude-longitude image of the environment (EXR, HDR, ...); its middle is -z")
        ->excludes(constant);
    addChoice(app, "--light-units", o.lightUnits,
              {{"auto", LightUnits::Auto},
               {"radiometric", LightUnits::Radiometric},
               {"photometric", LightUnits::Photometric}},
              "In what the file has its punctual lights. radiometric: W/sr and W/m2; photometric: cd and "
              "lx, which are divided by 683 lm/W; auto: radiometric where its extras say so or Blender's "
              "exporter shows it, otherwise photometric, and that is said");
    app.add_option("--effects", o.effects,
                   "What to simulate: auto, what the scene calls for; all, everything (the general\n"
                   "tracer, slower); auto,-NAME,... leaves effects out, which biases the image.\n"
                   "--explain prints their names")
        ->type_name("auto|all|auto,-NAME")
        ->capture_default_str();
    using enum IntegratorRequest;
    addChoice(app, "--integrator", o.integrator,
              {{"auto", Auto}, {"path", Path}, {"bidirectional", Bidirectional}},
              "How light is followed. path: from the camera; bidirectional: from the lights too, "
              "for caustics of small lights and hidden lights, at several times the cost of a "
              "sample; auto: where the scene may call for it, a short pilot decides");
    app.add_flag("--explain{text}", o.explain,
                 "Print which effects the scene calls for, why, what part of the time each takes\n"
                 "(from a short pilot), what surfaces paths meet, which integrator is chosen, and end; "
                 "--explain=json: the same as JSON")
        ->check(CLI::IsMember({"text", "json"}));
    app.add_option("--shutter", o.shutter,
                   "When the shutter opens and closes, in seconds of the scene's animations\n"
                   "(default: 0,0.0208; equal times freeze the picture)")
        ->delimiter(',')
        ->expected(2)
        ->type_name("OPEN,CLOSE");
    app.add_option("--band", o.band,
                   "Only band I of N, cut by rows from the top: the samples, bit for bit, that the whole\n"
                   "picture has there; vlx-pack merge joins them")
        ->excludes(time)
        ->excludes("--target-error")
        ->type_name("I/N");
    auto* sequence =
        app.add_option("--frames", o.frames,
                       "Trace these frames, for example 1-100x2,150: #### in the names of files stands for\n"
                       "the frame's number F. The shutter is moved by F / --fps seconds, the seed is a hash\n"
                       "of --seed and F. Samples hold motion vectors where the camera or something in\n"
                       "sight moves from frame to frame. When a frame fails the others go on")
            ->excludes("--list-cameras")
            ->excludes("--explain")
            ->type_name("LIST");
    app.add_option("--fps", o.framesPerSecond, "Frames a second of the scene's animations")
        ->check(finiteWithin(1e-6, 1e6))
        ->needs(sequence)
        ->capture_default_str();
    addOverwrite(app, o.overwrite);
    app.add_option("--threads", o.threads, "0: all processors. The result does not depend on it")
        ->check(CLI::Range(0, 4096))
        ->capture_default_str();
    using enum DumpCompression;
    addChoice(app, "--compression", o.render.compression, {{"none", None}, {"rle", Rle}, {"zips", Zips}},
              "Of the dump. rle: hardly slows tracing down; zips: a tenth smaller");
    app.add_flag("--json", o.json, "Print what was done as JSON on standard output");
}

// What is printed and no dump made would else seem to depend on them.
void checkOptions(const TraceOptions& o) {
    const std::string trace = "tracing", explaining = "--explain";
    const std::string atHand = o.listCameras ? "--list-cameras" : o.explain.empty() ? trace : explaining;
    checkOptionUse(*o.commandLine,
                   {{{"--output", "--overwrite", "--compression", "--json", "--band"}, {trace}},
                    {{"--camera",     "--variant",     "--camera-position", "--look-at",
                      "--fov",        "--light-units", "--width",           "--height",
                      "--crop",       "--spp",         "--hierarchical",    "--tolerance",
                      "--time",       "--replicates",  "--target-error",    "--append",
                      "--sample-map", "--seed",        "--max-bounces",     "--effects",
                      "--integrator", "--explain"},
                     {trace, explaining}}},
                   {atHand});
    if (o.shutter.size() == 2 &&
        !(std::isfinite(o.shutter[0]) && std::isfinite(o.shutter[1]) && o.shutter[0] <= o.shutter[1]))
        throw CLI::ValidationError("--shutter", "expected two finite times, the second not before the first");
    const auto requireWithin = [](const char* name, const std::vector<float>& values, float most) {
        for (const float value : values)
            if (!(std::abs(value) <= most))
                throw CLI::ValidationError(name, "expected values up to " +
                                                     formatted("%g", static_cast<double>(most)) + ", found " +
                                                     formatted("%g", static_cast<double>(value)));
    };
    requireWithin("--env-constant", o.environmentConstant, std::numeric_limits<float>::max());
    requireWithin("--camera-position", o.position, kFarthest);
    requireWithin("--look-at", o.target, kFarthest);
    if (o.integrator == IntegratorRequest::Bidirectional && o.targetError > 0)
        throw CLI::ValidationError("--target-error", "judges by path tracing: not with bidirectional");
}

TraceOptions ofFrame(const TraceOptions& o, int number) {
    TraceOptions one = o;
    for (std::string* name : {&one.scene, &one.dump, &one.environment.image, &one.earlierPath, &one.mapPath})
        *name = frameName(*name, number);
    one.frame = number;
    one.render.seed = hashOf(o.render.seed, number) >> 1;
    return one;
}

}  // namespace vlx::render
