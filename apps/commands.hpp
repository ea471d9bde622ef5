#pragma once

#include "apps/cli.hpp"

/// One function a subcommand: adds its flags and help to `app`; its callback does the work, throws
/// InputError for what is wrong outside, and sets `exit_code` (0 if it does not).
namespace pointflight::apps {

void add_map_command(CLI::App& app, int& exit_code);
void add_scan_command(CLI::App& app, int& exit_code);
void add_fly_command(CLI::App& app, int& exit_code);
void add_scenario_command(CLI::App& app, int& exit_code);
void add_lidar_command(CLI::App& app, int& exit_code);
void add_lidar_fit_command(CLI::App& lidar);
void add_vehicle_command(CLI::App& app, int& exit_code);
void add_vehicle_fit_command(CLI::App& vehicle);
void add_replay_command(CLI::App& app, int& exit_code);
void add_picture_command(CLI::App& app, int& exit_code);
void add_compare_command(CLI::App& app, int& exit_code);
void add_bag_command(CLI::App& app, int& exit_code);
void add_fidelity_command(CLI::App& app, int& exit_code);
void add_view_command(CLI::App& app, int& exit_code);
void add_campaign_command(CLI::App& app, int& exit_code);
void add_gpu_command(CLI::App& app, int& exit_code);
void add_study_command(CLI::App& app, int& exit_code);
void add_world_command(CLI::App& app, int& exit_code);
void add_raycast_command(CLI::App& app, int& exit_code);
void add_doctor_command(CLI::App& app, int& exit_code);
void add_self_test_command(CLI::App& app, int& exit_code);
void add_world_tasks_command(CLI::App& world);

/// Exit codes that scripts can trust.
enum ExitCode : int {
  kDone = 0,
  kRanButFailed = 1,   ///< Ended by a collision, or the mission was not finished.
  kWrongInput = 2,     ///< Flags, files, disk: anything outside.
  kInterrupted = 130,  ///< By a signal; files are closed.
};

}  // namespace pointflight::apps
