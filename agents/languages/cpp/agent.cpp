// Holds the pose in which an episode starts. It needs the standard library only:
//
//   g++ -std=c++20 -O2 -static-libstdc++ -static-libgcc -o agent agent.cpp
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <stdexcept>
#include <string>
#include <unistd.h>
#include <vector>

namespace {

// The text after `"key":`, without leading spaces.
std::string_view after(std::string_view line, std::string_view key) {
    const std::string quoted = '"' + std::string(key) + "\":";
    const auto at = line.find(quoted);
    if (at == std::string_view::npos) {
        throw std::runtime_error("no " + quoted + " in " + std::string(line));
    }
    line.remove_prefix(at + quoted.size());
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    return line;
}

std::vector<double> numbers(std::string_view line, std::string_view key) {
    const std::string rest(after(line, key));
    std::vector<double> values;
    const char *text = rest.c_str() + 1; // behind the bracket
    while (*text != ']') {
        char *end = nullptr;
        values.push_back(std::strtod(text, &end));
        text = *end == ',' ? end + 1 : end;
    }
    return values;
}

long number(std::string_view line, std::string_view key) {
    return std::strtol(std::string(after(line, key)).c_str(), nullptr, 10);
}

} // namespace

int main() {
    // Whatever a library prints goes to the log: standard output is for answers.
    std::FILE *answers = fdopen(dup(STDOUT_FILENO), "w");
    dup2(STDERR_FILENO, STDOUT_FILENO);
    std::cout << "hold in C++ " << __cplusplus << std::endl;

    std::vector<double> joints, pose;
    for (std::string line; std::getline(std::cin, line);) {
        const auto type = after(line, "type");
        if (type.starts_with("\"hello\"")) {
            joints = numbers(line, "joint_pos_ids");
            std::fputs("{\"type\":\"ready\",\"protocol\":1,\"interpolation\":3}\n", answers);
        } else if (type.starts_with("\"reset\"")) {
            pose.clear();
            std::fprintf(answers, "{\"type\":\"ready\",\"episode\":%ld}\n", number(line, "episode"));
        } else if (type.starts_with("\"step\"")) {
            if (pose.empty()) {
                const auto observation = numbers(line, "obs");
                for (const double index : joints) {
                    pose.push_back(observation.at(static_cast<std::size_t>(index)));
                }
            }
            std::fprintf(answers, "{\"type\":\"act\",\"step\":%ld,\"action\":[[", number(line, "step"));
            for (std::size_t i = 0; i < pose.size(); ++i) {
                std::fprintf(answers, "%s%.17g", i == 0 ? "" : ",", pose[i]);
            }
            std::fputs("],[0,0,0,0,0,0,0]]}\n", answers);
        } else if (type.starts_with("\"bye\"")) {
            return 0;
        }
        std::fflush(answers);
    }
}
