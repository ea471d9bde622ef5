// Who flies a campaign: threads here, tasks of Slurm, ranks of MPI.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "pointflight/campaign/campaign.hpp"
#include "pointflight/core/progress.hpp"

namespace pointflight {

/// Called once for each flight that is over; not from two threads at once.
using FlightDone = std::function<void(std::size_t number, const RunRecord& record)>;

/// Flies these on this machine, `jobs` at once, each in a process of its own. Ends early once
/// `stop` is set. Throws what `Campaign::fly` throws, when the others that fly are over.
void fly_here(const Campaign& campaign,
              const std::vector<std::size_t>& numbers,
              int jobs,
              const std::atomic<bool>& stop,
              const FlightDone& done);

/// One of several workers that share a campaign without knowing each other.
struct Share {
  std::size_t index = 0;  ///< From 0.
  std::size_t of = 1;     ///< At least 1.
};
/// "3/16". Throws InputError.
Share parse_share(const std::string& text);
/// Of these, the flights whose number leaves `index` when divided by `of`.
std::vector<std::size_t> share_of(const std::vector<std::size_t>& numbers, const Share& share);
/// Into how many shares, `most` or a few less, these flights are divided most evenly: what one of
/// eight tasks has left is all of one share of eight.
std::size_t even_shares(const std::vector<std::size_t>& numbers, std::size_t most);

/// How Slurm is asked.
struct SlurmOptions {
  std::size_t tasks = 0;           ///< Of the job array; 0: one for each flight, 100 at most.
  std::vector<std::string> words;  ///< For sbatch: "--partition=short", "--time=60".
  std::string program;             ///< Our own; on all nodes.
};

/// Has Slurm fly them: a job array by `sbatch`, each task a share of the campaign. Waits for its
/// end; a campaign whose job still runs is waited for and not sent again. With `stop` it comes back
/// and leaves the job running. Returns a line that says which job. Throws InputError if Slurm
/// refuses or is not there.
std::string fly_by_slurm(const Campaign& campaign,
                         const std::vector<std::size_t>& numbers,
                         const SlurmOptions& options,
                         const std::atomic<bool>& stop,
                         const Progress& progress);

}  // namespace pointflight
