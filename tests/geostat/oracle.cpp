// oracle [DIR]: every row of a folder's reference tables (default testdata/oracle) against the library; exit
// 1 if any failed.
#include "oracle.h"

#include <exception>
#include <filesystem>
#include <iostream>

int main(int argc, char** argv) {
    if (argc > 2) {
        std::cerr << "usage: oracle [DIR]\n";
        return 2;
    }
    std::filesystem::path folder = argc == 2 ? argv[1] : VLX_TESTDATA;
    for (const char* inner : {"oracle", "reference"})
        if (std::filesystem::is_directory(folder / inner)) folder /= inner;
    OracleCount total;
    for (const auto run : {runVariography, runPredictions}) {
        try {
            const OracleCount count = run(folder.string());
            total.passed += count.passed;
            total.failed += count.failed;
        } catch (const std::exception& error) {
            std::cout << "FAIL  " << error.what() << '\n';
            ++total.failed;
        }
    }
    std::cout << total.passed << " passed, " << total.failed << " failed\n";
    return total.failed > 0 || total.passed == 0 ? 1 : 0;
}
