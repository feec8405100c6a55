#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "render/film/render.h"
#include "render/pilot/choose_integrator.h"
#include "render/scene/scene_loader.h"

/// What vlx-trace is asked for.
namespace vlx::render {

struct TraceOptions {
    std::string scene;
    std::string dump;
    std::string camera;
    std::vector<float> position;  // of the camera: three numbers, or none
    std::vector<float> target;
    float verticalDegrees = 0;  // 0: as the camera has it
    std::string variant;
    int width = 0;
    int height = 0;
    std::vector<int> crop;
    std::vector<float> environmentConstant;
    EnvironmentOptions environment;
    LightUnits lightUnits = LightUnits::Auto;
    int threads = 0;
    bool listCameras = false;
    bool json = false;
    std::string effects = "auto";
    IntegratorRequest integrator = IntegratorRequest::Auto;
    std::string explain;
    std::vector<double> shutter;
    double timeLimit = 0;
    double targetError = 0;
    std::string earlierPath;
    std::string mapPath;
    std::string band;
    std::string frames;
    double framesPerSecond = 24;
    std::optional<int> frame;  // of --frames, the one at work
    bool tellsView = true;     // what camera is made: once in a sequence
    bool overwrite = false;
    RenderOptions render;
    const CLI::App* commandLine = nullptr;
};

void bindOptions(CLI::App& app, TraceOptions& o);

/// Throws CLI::ValidationError when options do not fit together.
void checkOptions(const TraceOptions& o);

/// Of --frames, what is asked for the frame `number`.
TraceOptions ofFrame(const TraceOptions& o, int number);

}  // namespace vlx::render
