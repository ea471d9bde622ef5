#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/share/clock_estimate.hpp"
#include "pointflight/share/messages.hpp"
#include "pointflight/share/remote_track.hpp"
#include "pointflight/share/share_setup.hpp"
#include "pointflight/share/share_transport.hpp"
#include "pointflight/share/shared_step.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight {

/// How a process takes part in a shared run.
struct FleetShareOptions {
  std::string run;                    ///< Name of the shared run, for messages.
  std::string process;                ///< What others call this process: "host:4711".
  std::uint64_t id = 0;               ///< Its random number.
  std::vector<std::size_t> vehicles;  ///< Those that it flies, ascending.
  double rate = 1.0;                  ///< Simulated seconds per second; 0: as fast as it goes.
  Duration settle = std::chrono::milliseconds(1000);  ///< Others are looked for so long at first.
  std::function<std::int64_t()> steady;               ///< A clock that only rises, ns.
  /// Where the run should be by the wall clock at an instant of `steady`; nothing before it starts.
  std::function<std::optional<SimTime>(std::int64_t steady)> clock;
  std::function<void(const std::string&)> log;  ///< Lines for users.
  std::function<bool()> interrupted;            ///< True once the user wants it to end.
};

/// One process of a shared run (docs/swarms.md): introduces itself, refuses what does not fit,
/// tells where its vehicles are, knows where the others' are. To the simulation it is the source of
/// each vehicle that another process flies, and the agreement on the end of the run. All from one
/// thread.
class FleetShare : public EndingAgreement {
 public:
  /// `simulation` and `transport` must outlive it.
  FleetShare(const Simulation& simulation, ShareTransport& transport, FleetShareOptions options);
  ~FleetShare() override;

  /// The simulation, which is the constructor's, flies its own vehicles from now on, and follows
  /// the others.
  void take_part(Simulation& simulation);
  /// Before the run: introduces itself and looks for others; true once it may start. Throws
  /// InputError if another process flies one of its vehicles, or in another world.
  bool is_ready();
  /// While it is ready: where the others' clocks are; the start of time if nobody flies yet.
  [[nodiscard]] SimTime time_of_others() const;
  /// What has to be done to be where the others are.
  struct Adjustment {
    Duration skip{0};   ///< Of the run's time, to be jumped over.
    Duration hurry{0};  ///< Of the pace: the run is due so much earlier.
  };
  /// Between steps: clocks. Mostly nothing has to be done.
  Adjustment keep_time();
  /// Tells that it leaves.
  void leave();
  /// Why this process has to end; empty while it has not to: another one flies its vehicles.
  [[nodiscard]] const std::string& fault() const { return fault_; }

  /// True in lockstep: the run ends for all at once.
  [[nodiscard]] bool decides_together() const;
  RunOutlook agree(const RunOutlook& own) override;
  /// What is known of a vehicle of another process, by number.
  [[nodiscard]] SourceReport report(std::size_t vehicle) const;

  /// Another process, for reports.
  struct PeerReport {
    std::string process;                ///< Its name, "host:4711".
    std::vector<std::size_t> vehicles;  ///< Numbers of those that it flies.
    std::optional<double> offset;       ///< Of its clock to this one's, s, as it was last.
    double offset_error = 0.0;          ///< s
    std::uint64_t received = 0;         ///< Messages with states.
    std::uint64_t missing = 0;          ///< That never came, by their counters.
  };
  /// All that take part, or did.
  [[nodiscard]] std::vector<PeerReport> peers() const;
  /// Messages that did not come from a process of this run.
  [[nodiscard]] std::uint64_t foreign() const { return foreign_; }
  /// At least one other process takes part, or did.
  [[nodiscard]] bool has_company() const;

 private:
  struct Peer {
    share_msg::Introduction intro;
    std::uint64_t writer = 0;  ///< Whom the transport says that it is.
    bool gone = false;         ///< The transport does not hear it any more.
    bool fits = false;         ///< It flies in the same world, and no vehicle of ours.
    bool lost = false;         ///< Silent for the lease.
    bool warned = false;       ///< Of what is wrong with it.
    std::int64_t heard = 0;    ///< `steady` when states came last.
    std::int64_t spoke = 0;    ///< The same of anything.
    /// Lockstep: lost because its steps do not come, though it runs; not taken back before, by
    /// `steady`, or before they come.
    std::int64_t back_from = 0;
    /// Lockstep: the last step that it has told by its beats, and whether as a verdict.
    std::pair<std::int64_t, bool> told{-1, false};
    bool waits = false;        ///< By its beats: for others.
    std::int64_t told_at = 0;  ///< `steady` when it first said that it had told what is needed.
    std::uint32_t counter = 0;
    std::uint64_t received = 0, missing = 0;
    ClockEstimate clock{1.0};
    std::optional<std::pair<std::int64_t, std::int64_t>> offset;  ///< Last, with its error, ns.
    std::int64_t its_sent = 0, its_arrival = 0;                   ///< Of its last clock message.
    bool owes_past = false;               ///< To it: it was lost, and is back.
    std::optional<share_msg::Past> past;  ///< What it said then, until its states have come.
    SimTime lost_at;
    std::deque<share_msg::States> steps;  ///< Lockstep: those that are still to be used.
    SimTime newest;                       ///< Of its states.
    [[nodiscard]] bool flies() const {
      return fits && !lost && intro.phase == share_msg::Phase::kFlying;
    }
  };
  /// A vehicle of another process.
  struct Other {
    RemoteTrack track;
    std::uint64_t process = 0;  ///< Who flies it.
    std::uint32_t flags = 0;
    bool seen = false;   ///< It has been there.
    bool there = false;  ///< Its states are heard.
    SimTime lost_at, back_at;
    bool jumped = false;     ///< It is not where it was: came, or came back.
    double moved = 0.0;      ///< For how long it was moved on last, s.
    bool asks_past = false;  ///< What happened while it was lost is still to be found out.
    SourceReport report;
  };
  /// Where an own vehicle was.
  struct OwnPast {
    SimTime time;
    share_msg::VehicleState state;
  };

  class RemoteVehicle;
  [[nodiscard]] std::optional<SourcedState> state_at(std::size_t vehicle, SimTime time);
  [[nodiscard]] std::optional<PoseTrack> track(std::size_t vehicle,
                                               SimTime from,
                                               SimTime until) const;
  [[nodiscard]] std::vector<VehicleEvent> take_events();
  [[nodiscard]] SharedStep own_step(bool is_verdict) const;
  void exchange(SimTime time);
  OtherVehicles meet(const SharedStep& own);

  void introduce(share_msg::Phase phase);
  void begin();
  void receive();
  void take(const ShareArrival& arrival);
  void take_introduction(const ShareArrival& arrival);
  void take_states(const ShareArrival& arrival);
  void take_clock(const ShareArrival& arrival);
  void take_past(const ShareArrival& arrival);
  void take_beat(const ShareArrival& arrival);
  void note_foreign(std::uint64_t writer, const std::string& what);
  void check(Peer& peer);
  void say_taken(const Peer& peer) const;
  void refuse_or_warn(Peer& peer, const std::string& what, bool refuses);
  [[nodiscard]] bool is_older(const Peer& peer) const;
  [[nodiscard]] Peer* peer_of(std::uint64_t process, std::uint64_t writer);
  void recheck_other_peers();
  void keep_introducing();
  [[nodiscard]] bool has_sane_shape(const share_msg::Introduction& intro) const;
  [[nodiscard]] std::vector<std::string> missing_vehicles() const;
  [[nodiscard]] bool may_join_steps();

  void lose_writer(std::uint64_t writer);
  void lose(Peer& peer, const char* kind, const std::string& words);
  void recover(Peer& peer);
  void mark_present(std::uint32_t number, Peer& peer);
  void watch_silence();
  void note(std::size_t vehicle, const char* kind, const std::string& words);

  void send_states(const SharedStep& own);
  void remember(const SharedStep& own);
  OtherVehicles meet_free();
  void place(OtherVehicles& met, std::size_t number);

  void repeat_beat(const SharedStep& own, bool waits);
  OtherVehicles meet_in_step(const SharedStep& own);
  [[nodiscard]] static const share_msg::States* step_of(const Peer& peer,
                                                        SimTime time,
                                                        bool verdict);
  [[nodiscard]] std::uint64_t joiner() const;
  [[nodiscard]] bool is_needed(Peer& peer, SimTime time);
  [[nodiscard]] bool is_hopeless(const Peer& peer, const SharedStep& own) const;
  [[nodiscard]] bool is_silent(const Peer& peer, std::int64_t since) const;
  [[nodiscard]] bool tells_in_vain(Peer& peer, SimTime needed, bool verdict);
  void give_up(Peer& peer, const std::string& words);
  bool lose_hopeless(Peer& peer, const SharedStep& own, SimTime needed, std::int64_t since);
  /// Since when nobody works, in lockstep.
  struct Standstill {
    std::vector<std::pair<std::int64_t, bool>> told;  ///< By all that fly.
    std::int64_t since = 0;                           ///< `steady`
  };
  [[nodiscard]] bool is_stuck(Standstill& standstill) const;
  void lose_all_waited_for(const SharedStep& own, SimTime needed, std::uint64_t joins);
  void wait_for_steps(const SharedStep& own, SimTime needed);
  void say_slow(SimTime needed, bool verdict);
  [[nodiscard]] bool is_back(const Peer& peer) const;
  [[nodiscard]] bool is_left_out() const;
  bool join_again();
  Adjustment rejoin();

  void send_clock();
  void say_offset(std::uint64_t id, const Peer& peer, std::int64_t offset, std::int64_t error);

  void send_past(Peer& peer);
  void look_back_if_asked(Peer& peer);
  void look_back(Peer& peer);
  void find_missed(std::uint32_t number, const RemoteTrack& track);
  void give_up_past();

  const Simulation& simulation_;
  ShareTransport& transport_;
  FleetShareOptions options_;
  ShareSetup setup_;
  Duration lease_;
  std::int64_t patience_;  ///< Lockstep, ns: with whom steps do not come from.
  Duration step_;
  Schedule schedule_;  ///< Of states that are sent, free.
  std::vector<share_msg::Part> parts_;
  std::map<std::uint64_t, Peer> peers_;
  std::vector<Other> others_;  ///< By number in the fleet; own ones are not used.
  std::deque<OwnPast> past_;
  std::vector<VehicleEvent> events_;
  SimTime now_;  ///< Of the last exchange.
  std::optional<SimTime> exchanged_at_;
  OtherVehicles met_;          ///< In the step under way.
  bool any_may_stop_ = false;  ///< A vehicle of the fleet has on_collision: stop.
  share_msg::Introduction own_;
  share_msg::Phase phase_ = share_msg::Phase::kJoining;
  bool introduced_ = false;
  bool flown_ = false;    ///< It has done a step.
  bool stopped_ = false;  ///< Another process left because of a collision.
  std::string fault_;
  std::int64_t introduced_at_ = 0;
  std::int64_t first_look_ = 0;
  std::int64_t said_waiting_ = 0;
  std::int64_t next_clock_ = 0;
  std::int64_t rejoins_from_ = 0;     ///< Lockstep: not before, by `steady`.
  std::int64_t next_sent_ = 0;        ///< Index in the schedule.
  std::deque<Bytes> last_sent_;       ///< States; in lockstep those that others may still need.
  std::deque<SharedStep> own_steps_;  ///< Lockstep with steps ahead: what was told, without states.
  std::uint32_t counter_ = 0;
  std::uint64_t foreign_ = 0;
  std::map<std::uint64_t, std::uint64_t> foreign_of_;  ///< Messages, by writer.
  std::map<std::uint64_t, bool> said_offset_;
};

}  // namespace pointflight
