// Prints what a running robot believes, and what it takes its partners to believe, with names.
//
//   cargo build --release -p reader
//   c++ -std=c++17 -Idocs/examples/c -o read_beliefs docs/examples/cpp/read_beliefs.cpp -Ltarget/release
//       -lleo_reader -Wl,-rpath,target/release
//   ./read_beliefs /dev/shm/leo-NAME [ROUNDS]
//
// docs/beliefs.md explains the frames and the board of names.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "leo_reader.h"

namespace {

std::string text(const leo_name& name)
{
    return {reinterpret_cast<const char*>(name.bytes), std::min<std::size_t>(name.length, LEO_NAME_CAPACITY)};
}

std::string text(const leo_text& text)
{
    return {reinterpret_cast<const char*>(text.bytes), std::min<std::size_t>(text.length, LEO_TEXT_CAPACITY)};
}

struct Frame {
    leo_belief_head head;
    std::vector<leo_belief> beliefs;
};

// A robot's beliefs, with errors as exceptions.
class Reader {
public:
    explicit Reader(const std::string& domain)
    {
        leo_text error;
        reader_.reset(leo_reader_open(domain.c_str(), &error));
        if (!reader_)
            throw std::runtime_error(text(error));
    }

    // The newest frame of a perspective, unless it was returned already.
    std::optional<Frame> next(std::uint32_t perspective)
    {
        Frame frame;
        leo_text error;
        const auto count = leo_reader_next(reader_.get(), perspective, &frame.head, &error);
        if (count == LEO_READER_FAILED)
            throw std::runtime_error(text(error));
        if (count < 0)
            return std::nullopt;
        frame.beliefs.resize(static_cast<std::size_t>(count));
        for (std::size_t index = 0; index < frame.beliefs.size(); index++)
            leo_reader_belief(reader_.get(), index, &frame.beliefs[index]);
        return frame;
    }

    // The names for beliefs of an incarnation of the belief process.
    std::unique_ptr<leo_symbols> symbols(std::uint64_t incarnation)
    {
        auto symbols = std::make_unique<leo_symbols>();
        if (!leo_reader_symbols(reader_.get(), incarnation, symbols.get()))
            return nullptr;
        return symbols;
    }

private:
    struct Close {
        void operator()(leo_reader* reader) const { leo_reader_close(reader); }
    };
    std::unique_ptr<leo_reader, Close> reader_;
};

// The first percept of a belief with this kernel; null if there is none.
const leo_remembered* remembered(const leo_symbols& symbols, const leo_belief& belief, leo_percept_kernel kernel)
{
    const auto end = belief.percepts + std::min<std::uint32_t>(belief.count, LEO_MAX_PERCEPTS);
    const auto percepts = std::min<std::uint32_t>(symbols.percept_count, LEO_MAX_PERCEPTS);
    const auto found = std::find_if(belief.percepts, end, [&](const leo_remembered& percept) {
        return percept.percept < percepts && symbols.percepts[percept.percept].kernel == kernel;
    });
    return found == end ? nullptr : found;
}

// The name of the symbol of a percept with this kernel.
std::optional<std::string> symbol(const leo_symbols& symbols, const leo_belief& belief, leo_percept_kernel kernel)
{
    const auto* percept = remembered(symbols, belief, kernel);
    if (percept == nullptr || percept->feature_kind != LEO_FEATURE_KIND_SYMBOL)
        return std::nullopt;
    const auto& description = symbols.percepts[percept->percept];
    const auto number = static_cast<std::uint32_t>(percept->feature[0]);
    if (number < std::min<std::uint32_t>(description.symbol_count, LEO_MAX_SYMBOLS))
        return text(description.symbols[number]);
    return text(description.name) + " " + std::to_string(number);
}

// A belief in words: "yellow square at (0.50, 0.10, 0.02), seen 12 times, 0.1 s ago".
std::string describe(const leo_symbols& symbols, const leo_belief_head& head, const leo_belief& belief)
{
    std::ostringstream out;
    out << std::fixed << std::setprecision(2);
    const auto colour = symbol(symbols, belief, LEO_PERCEPT_KERNEL_NEAREST_COLOUR);
    const auto shape = symbol(symbols, belief, LEO_PERCEPT_KERNEL_NEAREST_SHAPE);
    out << (colour ? *colour : "") << (colour && shape ? " " : "") << (shape ? *shape : "");
    if (!colour && !shape)
        out << "thing";
    const auto* position = remembered(symbols, belief, LEO_PERCEPT_KERNEL_POSITION);
    // In metres, in the frame of the perspective; the head has its pose.
    if (position != nullptr && position->feature_kind == LEO_FEATURE_KIND_VECTOR)
        out << " at (" << position->feature[0] << ", " << position->feature[1] << ", " << position->feature[2]
            << ")";
    const std::chrono::duration<double> age =
        std::chrono::nanoseconds(head.header.valid_at_ns - belief.perceived_at_ns);
    out << std::setprecision(1) << ", seen " << belief.observations << " times, " << age.count() << " s ago";
    return out.str();
}

void run(const std::string& domain, long rounds)
{
    Reader reader(domain);
    std::unique_ptr<leo_symbols> symbols;
    std::uint64_t incarnation = 0;
    while (rounds != 0) {
        if (!std::filesystem::exists(domain))
            throw std::runtime_error("the robot has ended");
        const auto agents = [&] { return symbols ? symbols->agent_count : 1; };
        for (std::uint32_t perspective = 0; perspective < agents(); perspective++) {
            const auto frame = reader.next(perspective);
            if (!frame)
                continue;
            // Another incarnation is a restarted process, with a board of its own.
            if (!symbols || frame->head.header.incarnation != incarnation) {
                incarnation = frame->head.header.incarnation;
                symbols = reader.symbols(incarnation);
                if (!symbols)
                    break;
            }
            std::cout << text(symbols->agents[perspective]) << ":\n";
            for (const auto& belief : frame->beliefs)
                std::cout << "  " << belief.id << ": " << describe(*symbols, frame->head, belief) << '\n';
            if (perspective == 0 && rounds > 0)
                rounds--;
        }
        std::cout.flush();
        std::this_thread::sleep_for(std::chrono::milliseconds(500));
    }
}

}  // namespace

int main(int count, char** arguments)
{
    if (count < 2) {
        std::cerr << "usage: read_beliefs /dev/shm/leo-NAME [ROUNDS]\n";
        return 2;
    }
    try {
        run(arguments[1], count > 2 ? std::strtol(arguments[2], nullptr, 10) : -1);
    } catch (const std::exception& error) {
        std::cerr << error.what() << '\n';
        return 1;
    }
    return 0;
}
