#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <string>

#include "variolux/base/progress.h"

namespace vlx {

/// Who reads what a tool says about its progress.
enum class LogFormat {
    Text,    ///< people: a bar, on a terminal only
    Json,    ///< programs: a line of JSON on stderr at the start, once a second, and in the end
    OpenJd,  ///< Open Job Description: openjd_progress and openjd_status lines on stdout, as often
};

/// For all progress from now on. Called once, before any.
void setLogFormat(LogFormat format);
LogFormat logFormat();
/// No bars for people from now on.
void hideProgressBars(bool hidden);
/// Takes the bar that is drawn, if there is one, off the terminal, before a line is written there.
void eraseProgressBar();

/// One line that says how far a task is: label, bar, percent, time left. Redrawn in place at most ten times a
/// second, and only when `stream` is a terminal: nothing is written into a log file or a pipe. Erased when
/// the object goes. With another LogFormat it writes that instead, terminal or not. Safe to be told from
/// several threads; must outlive the Progress made from it.
class ProgressBar {
  public:
    explicit ProgressBar(std::string label, std::FILE* stream = stderr);
    ~ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    /// What library functions report to; empty when nothing is drawn.
    operator Progress();

    void erase();

  private:
    using Clock = std::chrono::steady_clock;
    void update(std::int64_t done, std::int64_t total);

    const std::string label_;
    std::FILE* const stream_;
    const bool terminal_;
    const Clock::time_point start_ = Clock::now();
    std::mutex mutex_;
    Clock::time_point drawn_;
    double fraction_ = 0;
    bool visible_ = false;
};

/// What programs read: one record of `fraction` in [0, 1] done after `seconds`, ended by a line break.
///     {"event":"progress","task":"kriging","fraction":0.25,"seconds":10.0,"secondsLeft":30.0,
///      "peakMemoryMB":210.0}                                                      (on one line)
/// secondsLeft is null as long as it cannot be told. Or the lines "openjd_status: kriging" and
/// "openjd_progress: 25.0".
std::string progressRecord(LogFormat format, const std::string& label, double fraction, double seconds,
                           double peakMegabytes);

/// The most memory that this process has had, in 10^6 bytes.
double peakMegabytes();

/// The text of the line, at most `columns` characters: `fraction` in [0, 1] is done after `seconds`.
std::string progressLine(const std::string& label, double fraction, double seconds, int columns);

/// "12 s", "3 min 05 s", "2 h 07 min".
std::string durationText(double seconds);

}  // namespace vlx
