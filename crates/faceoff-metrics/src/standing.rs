use crate::latest::Latest;
use prometheus_client::{
    encoding::EncodeLabelSet,
    metrics::{family::Family, gauge::Gauge},
    registry::{Registry, Unit},
};

/// How things stand at the moment that somebody reads.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Standing {
    /// Could the database be written, a moment ago?
    pub database_writable: bool,
    pub queue: Queue,
    /// Evaluations that are not over.
    pub open_evaluations: u32,
    /// Slots of this process.
    pub slots: u32,
    /// Slots of workers elsewhere that can be given work.
    pub remote_slots: u32,
    /// Workers elsewhere that were heard of a moment ago.
    pub remote_workers: usize,
    /// Units that one of them has worked at for so long that it is worth a look.
    pub remote_long: usize,
    /// The disks that the server writes to.
    pub disks: Vec<Disk>,
    /// What the process holds.
    pub process: Process,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Queue {
    /// Under a lease that runs.
    pub running: u32,
    /// That could be begun.
    pub waiting: u32,
    /// That found no room again and again.
    pub without_room: u32,
    /// Is nothing begun: held by an organiser, or for want of room?
    pub paused: bool,
    /// For how long the first of what waits has waited, seconds; 0: nothing waits.
    pub oldest_wait_s: f64,
    /// In how long all that counts is expected to be over with the slots there are now, seconds; not a number: nobody can tell.
    pub expected_s: f64,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Disk {
    /// What it is for: `data` or `scratch`.
    pub of: &'static str,
    /// Bytes that are free.
    pub free_bytes: u64,
    pub size_bytes: u64,
}

/// What the operating system counts of this process.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Process {
    /// Memory that it has in use, bytes.
    pub resident_bytes: u64,
    /// Descriptors that it has open.
    pub open_fds: u64,
    /// Descriptors that it may have open.
    pub max_fds: u64,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OfState {
    state: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OfDisk {
    disk: &'static str,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Gauges {
    writable: Gauge,
    units: Family<OfState, Gauge>,
    paused: Gauge,
    oldest_wait: Latest,
    expected: Latest,
    evaluations: Gauge,
    slots: Gauge,
    remote_slots: Gauge,
    remote_workers: Gauge,
    remote_long: Gauge,
    free: Family<OfDisk, Gauge>,
    size: Family<OfDisk, Gauge>,
    resident: Gauge,
    fds: Gauge,
    most_fds: Gauge,
}

impl Gauges {
    pub(crate) fn new(all: &mut Registry) -> Self {
        let gauges = Self::default();
        all.register(
            "database_writable",
            "1 if the database could be written a moment ago; it was tried",
            gauges.writable.clone(),
        );
        all.register(
            "queue_units",
            "Units of work: running, waiting, or waiting for room on a disk",
            gauges.units.clone(),
        );
        all.register(
            "queue_paused",
            "1 if nothing is begun: held by an organiser, or for want of room",
            gauges.paused.clone(),
        );
        all.register_with_unit(
            "queue_oldest_wait",
            "For how long the first of what waits could have been begun",
            Unit::Seconds,
            gauges.oldest_wait.clone(),
        );
        all.register_with_unit(
            "queue_expected",
            "In how long all that counts is expected to be over with the slots there are; NaN where that was never measured, or the queue is held",
            Unit::Seconds,
            gauges.expected.clone(),
        );
        all.register(
            "evaluations_open",
            "Evaluations that are not over",
            gauges.evaluations.clone(),
        );
        all.register("slots", "Slots of this process", gauges.slots.clone());
        all.register(
            "remote_slots",
            "Slots of workers on other machines that can be given work",
            gauges.remote_slots.clone(),
        );
        all.register(
            "remote_workers",
            "Workers on other machines that were heard of in the last half minute",
            gauges.remote_workers.clone(),
        );
        all.register(
            "remote_long_units",
            "Units that a worker on another machine has worked at for more than an hour",
            gauges.remote_long.clone(),
        );
        all.register_with_unit(
            "disk_free",
            "Room on the disks that the server writes to",
            Unit::Bytes,
            gauges.free.clone(),
        );
        all.register_with_unit(
            "disk_size",
            "Size of these disks",
            Unit::Bytes,
            gauges.size.clone(),
        );
        all.register_with_unit(
            "process_resident_memory",
            "Memory of the server itself, without agents",
            Unit::Bytes,
            gauges.resident.clone(),
        );
        all.register(
            "process_open_fds",
            "Descriptors that the server has open",
            gauges.fds.clone(),
        );
        all.register(
            "process_max_fds",
            "Descriptors that it may have open",
            gauges.most_fds.clone(),
        );
        gauges
    }

    pub(crate) fn set(&self, now: &Standing) {
        let Standing {
            database_writable,
            queue,
            open_evaluations,
            slots,
            remote_slots,
            remote_workers,
            remote_long,
            disks,
            process,
        } = now;
        self.writable.set((*database_writable).into());
        for (state, count) in [
            ("running", queue.running),
            ("waiting", queue.waiting),
            ("without_room", queue.without_room),
        ] {
            self.units
                .get_or_create(&OfState { state })
                .set(count.into());
        }
        self.paused.set(queue.paused.into());
        self.oldest_wait.set(queue.oldest_wait_s);
        self.expected.set(queue.expected_s);
        self.evaluations.set((*open_evaluations).into());
        self.slots.set((*slots).into());
        self.remote_slots.set((*remote_slots).into());
        self.remote_workers
            .set(i64::try_from(*remote_workers).unwrap_or(i64::MAX));
        self.remote_long
            .set(i64::try_from(*remote_long).unwrap_or(i64::MAX));
        for disk in disks {
            let of = OfDisk { disk: disk.of };
            self.free.get_or_create(&of).set(whole(disk.free_bytes));
            self.size.get_or_create(&of).set(whole(disk.size_bytes));
        }
        self.resident.set(whole(process.resident_bytes));
        self.fds.set(whole(process.open_fds));
        self.most_fds.set(whole(process.max_fds));
    }
}

/// No limit is as good as the largest number.
fn whole(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}
