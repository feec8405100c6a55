#include "progress_bar.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

namespace vlx {

namespace {

int terminalColumns(std::FILE* stream) {
    winsize size{};
    if (::ioctl(::fileno(stream), TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
    return size.ws_col;
}

std::string twoDigits(std::int64_t value) { return (value < 10 ? "0" : "") + std::to_string(value); }

}  // namespace

ProgressBar::ProgressBar(std::string label, std::FILE* stream)
    : label_(std::move(label)), stream_(stream), terminal_(::isatty(::fileno(stream)) == 1) {}

ProgressBar::~ProgressBar() {
    if (!visible_) return;
    std::fputs("\r\033[K", stream_);
    std::fflush(stream_);
}

ProgressBar::operator Progress() {
    if (!terminal_) return {};
    return [this](std::int64_t done, std::int64_t total) { update(done, total); };
}

void ProgressBar::update(std::int64_t done, std::int64_t total) {
    // A thread that finds another one drawing goes on with its work.
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock || total <= 0) return;
    const auto now = Clock::now();
    if (visible_ && now - drawn_ < std::chrono::milliseconds(100)) return;
    // Reports of several threads may overtake each other: the bar never goes back.
    fraction_ = std::max(fraction_, static_cast<double>(done) / static_cast<double>(total));
    const double seconds = std::chrono::duration<double>(now - start_).count();
    const std::string line = progressLine(label_, fraction_, seconds, terminalColumns(stream_) - 1);
    std::fprintf(stream_, "\r%s\033[K", line.c_str());
    std::fflush(stream_);
    drawn_ = now;
    visible_ = true;
}

std::string progressLine(const std::string& label, double fraction, double seconds, int columns) {
    fraction = std::clamp(fraction, 0.0, 1.0);
    const int percent = static_cast<int>(fraction * 100);
    std::string tail = (percent < 10 ? "  " : percent < 100 ? " " : "") + std::to_string(percent) + " %";
    // The first instants say nothing about the rest.
    if (fraction > 0 && fraction < 1 && seconds >= 1)
        tail += ", " + durationText(seconds * (1 - fraction) / fraction) + " left";
    const int room = std::min(columns - static_cast<int>(label.size() + tail.size()) - 5, 40);
    std::string line = label + ' ';
    if (room >= 5) {
        const int filled = static_cast<int>(std::lround(fraction * room));
        line += " [" + std::string(static_cast<std::size_t>(filled), '#') +
                std::string(static_cast<std::size_t>(room - filled), '.') + "] ";
    }
    line += tail;
    return line.substr(0, static_cast<std::size_t>(std::max(columns, 0)));
}

std::string durationText(double seconds) {
    if (!(seconds < 1e9)) return "very long";
    const auto whole = static_cast<std::int64_t>(std::ceil(std::max(seconds, 0.0)));
    if (whole < 60) return std::to_string(whole) + " s";
    if (whole < 3600) return std::to_string(whole / 60) + " min " + twoDigits(whole % 60) + " s";
    return std::to_string(whole / 3600) + " h " + twoDigits(whole % 3600 / 60) + " min";
}

}  // namespace vlx
