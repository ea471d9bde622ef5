#include "apps/terminal.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <memory>

#include "pointflight/core/shell_words.hpp"

namespace pointflight::apps {
namespace {

std::atomic<bool> progress_line_open{false};
std::atomic<bool> leaves_static_objects{false};
volatile std::sig_atomic_t interrupt_seen = 0;

extern "C" void on_interrupt(int /*signal*/) {
  interrupt_seen = 1;
}

}  // namespace

void say(std::string_view text) {
  // not fmt::print, which throws if stderr is closed or full
  std::fwrite(text.data(), 1, text.size(), stderr);
}

Progress terminal_progress() {
  using Clock = std::chrono::steady_clock;
  struct State {
    Clock::time_point start = Clock::now();
    Clock::time_point last = start;
    std::string what;
    int tenth = -1;
    bool terminal = ::isatty(STDERR_FILENO) != 0;
  };
  auto state = std::make_shared<State>();
  return [state](std::string_view what, double share) {
    const auto now = Clock::now();
    if (now - state->start < std::chrono::seconds(1)) return;
    const int percent = static_cast<int>(std::lround(share * 100.0));
    if (state->terminal) {
      if (now - state->last < std::chrono::milliseconds(100)) return;
      state->last = now;
      say(fmt::format("\r\033[K{} {} %", what, percent));
      progress_line_open = true;
    } else if (what != state->what || percent / 10 != state->tenth) {
      state->what = std::string(what);
      state->tenth = percent / 10;
      say(fmt::format("{} {} %\n", what, percent));
    }
  };
}

void end_progress() {
  if (progress_line_open.exchange(false)) say("\r\033[K");
}

std::string printable(std::string_view text) {
  std::string shown(text);
  for (char& c : shown) c = static_cast<unsigned char>(c) < ' ' || c == '\x7f' ? '?' : c;
  return shown;
}

void log(std::string_view text) {
  end_progress();
  say(printable(text) + "\n");
}

std::string command_line() {
  std::ifstream file("/proc/self/cmdline");
  std::string line;
  for (std::string word; std::getline(file, word, '\0');) {
    line += (line.empty() ? "" : " ") + shell_word(word);
  }
  return line;
}

std::string short_count(double count) {
  if (count >= 1e9) return fmt::format("{:.2f} G", count / 1e9);
  if (count >= 1e6) return fmt::format("{:.2f} M", count / 1e6);
  if (count >= 1e4) return fmt::format("{:.1f} k", count / 1e3);
  return fmt::format("{:.0f}", count);
}

Progress interruptible_progress() {
  catch_interrupts();
  return [show = terminal_progress()](std::string_view what, double share) {
    if (interrupted()) throw Interrupted();
    show(what, share);
  };
}

void catch_interrupts() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  if (std::signal(SIGHUP, on_interrupt) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
}

bool interrupted() {
  return interrupt_seen != 0;
}

void leave_static_objects() {
  leaves_static_objects = true;
}

bool must_leave_static_objects() {
  return leaves_static_objects;
}

}  // namespace pointflight::apps
