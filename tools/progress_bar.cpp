#include "progress_bar.h"

#include <sys/ioctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <nlohmann/json.hpp>

#include "variolux/base/text.h"

namespace vlx {

namespace {

int terminalColumns(std::FILE* stream) {
    winsize size{};
    if (::ioctl(::fileno(stream), TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
    return size.ws_col;
}

std::atomic<LogFormat> currentFormat{LogFormat::Text};
std::atomic<bool> barsHidden{false};
std::atomic<ProgressBar*> lastBar{nullptr};

std::string twoDigits(std::int64_t value) { return (value < 10 ? "0" : "") + std::to_string(value); }

}  // namespace

ProgressBar::ProgressBar(std::string label, std::FILE* stream)
    : label_(std::move(label)), stream_(stream), terminal_(::isatty(::fileno(stream)) == 1) {
    lastBar = this;
}

void setLogFormat(LogFormat format) { currentFormat = format; }
LogFormat logFormat() { return currentFormat; }
void hideProgressBars(bool hidden) { barsHidden = hidden; }
void eraseProgressBar() {
    if (ProgressBar* const bar = lastBar) bar->erase();
}

ProgressBar::~ProgressBar() {
    ProgressBar* self = this;
    lastBar.compare_exchange_strong(self, nullptr);
    erase();
}

void ProgressBar::erase() {
    const std::lock_guard lock(mutex_);
    if (!visible_ || logFormat() != LogFormat::Text) return;
    std::fputs("\r\033[K", stream_);
    std::fflush(stream_);
    visible_ = false;
}

ProgressBar::operator Progress() {
    if ((!terminal_ || barsHidden) && logFormat() == LogFormat::Text) return {};
    return [this](std::int64_t done, std::int64_t total) { update(done, total); };
}

void ProgressBar::update(std::int64_t done, std::int64_t total) {
    // A thread that finds another one drawing goes on with its work.
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock || total <= 0) return;
    const auto now = Clock::now();
    const LogFormat format = logFormat();
    const auto pause = std::chrono::milliseconds(format == LogFormat::Text ? 100 : 1000);
    const bool last = format != LogFormat::Text && done >= total && fraction_ < 1;
    if (visible_ && now - drawn_ < pause && !last) return;
    // Reports of several threads may overtake each other: the bar never goes back.
    fraction_ = std::max(fraction_, static_cast<double>(done) / static_cast<double>(total));
    const double seconds = std::chrono::duration<double>(now - start_).count();
    if (format != LogFormat::Text) {
        std::FILE* const stream = format == LogFormat::Json ? stream_ : stdout;
        std::fputs(progressRecord(format, label_, fraction_, seconds, peakMegabytes()).c_str(), stream);
        std::fflush(stream);
        drawn_ = now;
        visible_ = true;
        return;
    }
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

std::string progressRecord(LogFormat format, const std::string& label, double fraction, double seconds,
                           double peakMegabytes) {
    fraction = std::clamp(fraction, 0.0, 1.0);
    if (format == LogFormat::OpenJd) {
        return "openjd_status: " + label + "\nopenjd_progress: " + formatted("%.1f", fraction * 100) + "\n";
    }
    const auto rounded = [](double value, double unit) { return std::round(value / unit) * unit; };
    nlohmann::ordered_json record = {{"event", "progress"},
                                     {"task", label},
                                     {"fraction", rounded(fraction, 1e-4)},
                                     {"seconds", rounded(seconds, 1e-2)},
                                     {"secondsLeft", nullptr},
                                     {"peakMemoryMB", std::round(peakMegabytes)}};
    if (fraction >= 1)
        record["secondsLeft"] = 0.0;
    else if (fraction > 0 && seconds >= 1)
        record["secondsLeft"] = rounded(seconds * (1 - fraction) / fraction, 0.1);
    return record.dump() + "\n";
}

double peakMegabytes() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) * 1024 * 1e-6;
}

std::string durationText(double seconds) {
    if (!(seconds < 1e9)) return "very long";
    const auto whole = static_cast<std::int64_t>(std::ceil(std::max(seconds, 0.0)));
    if (whole < 60) return std::to_string(whole) + " s";
    if (whole < 3600) return std::to_string(whole / 60) + " min " + twoDigits(whole % 60) + " s";
    return std::to_string(whole / 3600) + " h " + twoDigits(whole % 3600 / 60) + " min";
}

}  // namespace vlx
