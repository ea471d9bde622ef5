// MPI for campaigns: numbers dealt out by rank 0 to whoever is free.
#include <mpi.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <thread>

#include "pointflight/campaign/mpi_module.hpp"

namespace pointflight {
namespace {

constexpr int kAsk = 1;
constexpr int kDeal = 2;
/// Between looks: MPI's own waits keep a core busy, which flights need.
constexpr auto kLook = std::chrono::milliseconds(1);

void wait_for(MPI_Request& request) {
  int is_done = 0;
  while (MPI_Test(&request, &is_done, MPI_STATUS_IGNORE), is_done == 0) {
    std::this_thread::sleep_for(kLook);
  }
}

/// Rank 0's: answers the others while this process flies as well.
class Dealer {
 public:
  Dealer() : thread_([this] { serve(); }) {}
  ~Dealer() {
    over_ = true;
    thread_.join();
  }
  Dealer(const Dealer&) = delete;
  Dealer& operator=(const Dealer&) = delete;
  unsigned long long next() { return next_++; }

 private:
  void serve() {
    while (!over_) {
      int is_there = 0;
      MPI_Status status{};
      MPI_Iprobe(MPI_ANY_SOURCE, kAsk, MPI_COMM_WORLD, &is_there, &status);
      if (is_there == 0) {
        std::this_thread::sleep_for(kLook);
        continue;
      }
      MPI_Recv(nullptr, 0, MPI_BYTE, status.MPI_SOURCE, kAsk, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
      const unsigned long long number = next_++;
      MPI_Send(&number, 1, MPI_UNSIGNED_LONG_LONG, status.MPI_SOURCE, kDeal, MPI_COMM_WORLD);
    }
  }

  std::atomic<unsigned long long> next_ = 0;
  std::atomic<bool> over_ = false;
  std::thread thread_;
};

struct Job {
  int rank = 0;
  int size = 1;
  bool deals = false;  ///< The library allows calls from several threads.
  std::size_t dealt = 0;
  std::unique_ptr<Dealer> dealer;
};
Job& job() {
  static Job the_job;
  return the_job;
}

void begin() {
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_MULTIPLE, &provided);
  MPI_Comm_rank(MPI_COMM_WORLD, &job().rank);
  MPI_Comm_size(MPI_COMM_WORLD, &job().size);
  job().deals = provided >= MPI_THREAD_MULTIPLE;
  if (job().deals && job().rank == 0) job().dealer = std::make_unique<Dealer>();
}

void barrier() {
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibarrier(MPI_COMM_WORLD, &request);
  wait_for(request);
}

std::size_t next() {
  if (!job().deals) {  // each its share
    return static_cast<std::size_t>(job().rank) +
           static_cast<std::size_t>(job().size) * job().dealt++;
  }
  if (job().dealer) return job().dealer->next();
  unsigned long long number = 0;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Irecv(&number, 1, MPI_UNSIGNED_LONG_LONG, 0, kDeal, MPI_COMM_WORLD, &request);
  MPI_Send(nullptr, 0, MPI_BYTE, 0, kAsk, MPI_COMM_WORLD);
  wait_for(request);
  return static_cast<std::size_t>(number);
}

void end() {
  job().dealer.reset();
  MPI_Finalize();
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const MpiModule* pointflight_mpi_module() {
  static const MpiModule module = {
      begin, [] { return job().rank; }, [] { return job().size; }, barrier, next, end};
  return &module;
}

}  // namespace pointflight
