#include "sweep/machine.h"

#include <sys/utsname.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <limits>
#include <thread>

#include "sweep/sweep.h"

namespace vlx {

double loadAverage() {
    double load = 0;
    return ::getloadavg(&load, 1) == 1 ? load : std::numeric_limits<double>::quiet_NaN();
}

Machine thisMachine() {
    Machine machine;
    std::ifstream cpu("/proc/cpuinfo");
    for (std::string line; std::getline(cpu, line);)
        if (line.starts_with("model name")) {
            machine.processor = line.substr(std::min(line.size(), line.find(':') + 2));
            break;
        }
    machine.processors = static_cast<int>(std::thread::hardware_concurrency());
    machine.memoryGigabytes = static_cast<double>(::sysconf(_SC_PHYS_PAGES)) *
                              static_cast<double>(::sysconf(_SC_PAGE_SIZE)) / (1 << 30);
    utsname system{};
    if (::uname(&system) == 0) machine.system = std::string(system.sysname) + " " + system.release;
    return machine;
}

}  // namespace vlx
