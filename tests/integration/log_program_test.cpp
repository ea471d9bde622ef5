#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "pointflight/vehicle/airframe.hpp"
#include "tests/flight_log/flown_log.hpp"
#include "tests/flight_log/log_bytes.hpp"
#include "tests/integration/program.hpp"

/// Logs of flight controllers on the command line.
namespace pointflight {
namespace {

using testing::expect_contains;
using testing::expect_user_error;
using testing::Program;
using testing::read_file;
using testing::Result;
using testing::run;
using testing::TemporaryFolder;
using testing::write_file;

std::string x500_flight(double duration, bool is_ulog) {
  FlownLogOptions options;
  options.duration = duration;
  const FlightLog log = flown_log(load_vehicle("x500"), options);
  return is_ulog ? ulog_of(log) : dataflash_of(log);
}

TEST(LogProgram, AVehicleIsFittedAndFliesTheLogBetter) {
  const TemporaryFolder folder;
  const std::string flight = folder / "flight.ulg";
  write_file(flight, x500_flight(40.0, true));
  std::string file = read_file(load_vehicle("x500").path);
  const std::string mass = "mass: 2.064";
  ASSERT_NE(file.find(mass), std::string::npos);
  const std::string inertia = "inertia_diagonal: [0.0239, 0.0239, 0.0439]";
  file.replace(file.find(inertia), inertia.size(), "inertia_diagonal: [0.03, 0.018, 0.06]");
  write_file(folder / "guess.yaml", file);

  const Result fit = run(fmt::format("vehicle fit {} --like {} -o {} --json",
                                     flight,
                                     folder / "guess.yaml",
                                     folder / "mine.yaml"));
  ASSERT_EQ(fit.code, 0) << fit.err;
  const auto json = nlohmann::json::parse(fit.out);
  EXPECT_EQ(json["firmware"], "PX4");
  const VehicleSettings mine = load_vehicle(folder / "mine.yaml");
  EXPECT_NEAR(mine.inertia_diagonal.x() / 0.0239, 1.0, 0.05);
  EXPECT_NEAR(mine.inertia_diagonal.y() / 0.0239, 1.0, 0.05);
  EXPECT_NEAR(mine.inertia_diagonal.z() / 0.0439, 1.0, 0.05);
  expect_contains(mine.source, "fitted to a log (pointflight vehicle fit flight.ulg)");

  const auto tilt = [&](const std::string& vehicle) {
    const Result result = run(fmt::format("replay {} --vehicle {} --json", flight, vehicle));
    EXPECT_EQ(result.code, 0) << result.err;
    return nlohmann::json::parse(result.out)["tilt_rms_deg"].get<double>();
  };
  EXPECT_LT(tilt(folder / "mine.yaml"), 0.7 * tilt(folder / "guess.yaml"));
  // to people the same figures are a table
  const Result table = run(fmt::format("vehicle fit {} --like x500", flight));
  expect_contains(table.out, "rotor.thrust_coefficient");
  expect_contains(table.out, "thrust to weight");
}

TEST(LogProgram, PicturesAndTablesOfAnArduPilotLog) {
  const TemporaryFolder folder;
  const std::string flight = folder / "00000007.BIN";
  write_file(flight, x500_flight(12.0, false));
  const Result result = run(fmt::format(
      "replay {} --vehicle x500 --png {} --csv {}", flight, folder / "l.png", folder / "l.csv"));
  ASSERT_EQ(result.code, 0) << result.err;
  expect_contains(result.out, "ArduPilot");
  expect_contains(result.out, "rates ");
  EXPECT_EQ(read_file(folder / "l.png").substr(1, 3), "PNG");
  expect_contains(read_file(folder / "l.csv"), "time,in_window,logged_gx");
  expect_user_error(run(fmt::format("replay {} --vehicle x500 --csv {}", flight, folder / "l.csv")),
                    "--force");
}

TEST_F(Program, AReplaySeesTheMapAlongTheLoggedWay) {
  const TemporaryFolder folder;
  const std::string flight = folder / "flight.ulg";
  write_file(flight, x500_flight(12.0, true));
  const Result result =
      run(fmt::format("replay {} {} --vehicle x500 --lidar mid360 --origin 12,10,5,90 -o {} --json",
                      flight,
                      map(),
                      folder / "run"));
  ASSERT_EQ(result.code, 0) << result.err;
  // its first position is that of the log, turned by a quarter and moved
  const FlightLog log = parsed(read_file(flight));
  const Vector3d p = log.motion.front().p_world;
  const std::string text = read_file(folder / "run/trajectory.csv");
  std::string line = text.substr(text.find('\n') + 1);
  line = line.substr(line.find(',') + 1);
  const double x = std::stod(line);
  EXPECT_NEAR(x, 12.0 - p.y(), 1.0);
  EXPECT_FALSE(read_file(folder / "run/overview.png").empty());
}

TEST(LogProgram, WrongCommandsAreALine) {
  const TemporaryFolder folder;
  const std::string flight = folder / "flight.ulg";
  write_file(flight, x500_flight(3.0, true));
  expect_user_error(run("vehicle fit /nowhere.ulg --like x500"), "/nowhere.ulg");
  expect_user_error(run(fmt::format("vehicle fit {} --like x500", flight)), "10 s are needed");
  expect_user_error(run(fmt::format("replay {} --vehicle hexa_550", flight)), "rotors");
  expect_user_error(run(fmt::format("replay {} --vehicle x500 -o {}", flight, folder / "r")),
                    "without a map");
  write_file(folder / "junk.ulg", std::string(5000, 'x'));
  expect_user_error(run(fmt::format("replay {} --vehicle x500", folder / "junk.ulg")),
                    "neither a ULog");
}

}  // namespace
}  // namespace pointflight
