// SPDX-License-Identifier: Apache-2.0 OR GPL-2.0
// A PTP clock of the virtual machine (fetch_modules): CLOCK_MONOTONIC_RAW and an offset, which clock_settime() sets and
// /sys/module/hueline_ptp/parameters/offset_ns tells as it was then, and a rate, which programs of linuxptp set. `comparison` says which of the kernel's ways of comparing it has: 0 the basic one
// alone, 1 the extended one too, 2 the precise one too. The kernel's core of PTP does everything else.
#include <linux/ktime.h>
#include <linux/math64.h>
#include <linux/module.h>
#include <linux/ptp_clock_kernel.h>
#include <linux/spinlock.h>

static long offset_ns;
module_param(offset_ns, long, 0444);
static int comparison;
module_param(comparison, int, 0444);

static struct ptp_clock *clock;

// At begin_raw the clock said begin_device; since then it has run faster by `rate`, in 2^-16 ppm.
static DEFINE_SPINLOCK(lock);
static u64 begin_raw, begin_device;
static s64 rate;

static u64 at_raw_locked(u64 raw)
{
	s64 since = raw - begin_raw;

	return begin_device + since + div64_s64(since * rate, 65536LL * 1000000);
}

static u64 at_raw(u64 raw)
{
	unsigned long flags;
	u64 time;

	spin_lock_irqsave(&lock, flags);
	time = at_raw_locked(raw);
	spin_unlock_irqrestore(&lock, flags);
	return time;
}

// Goes on from now, `by_ns` later and with that rate; or from `to` if that is given.
static void go_on(const struct timespec64 *to, s64 by_ns, s64 new_rate)
{
	unsigned long flags;
	u64 raw;

	spin_lock_irqsave(&lock, flags);
	raw = ktime_get_raw_ns();
	begin_device = to ? timespec64_to_ns(to) : at_raw_locked(raw) + by_ns;
	begin_raw = raw;
	rate = new_rate;
	WRITE_ONCE(offset_ns, begin_device - raw);
	spin_unlock_irqrestore(&lock, flags);
}

static u64 read_ns(void)
{
	return at_raw(ktime_get_raw_ns());
}

static int get_basic(struct ptp_clock_info *info, struct timespec64 *time)
{
	*time = ns_to_timespec64(read_ns());
	return 0;
}

static int get_extended(struct ptp_clock_info *info, struct timespec64 *time, struct ptp_system_timestamp *around)
{
	ptp_read_system_prets(around);
	*time = ns_to_timespec64(read_ns());
	ptp_read_system_postts(around);
	return 0;
}

static int get_precise(struct ptp_clock_info *info, struct system_device_crosststamp *at_once)
{
	u64 raw = ktime_get_raw_ns();

	at_once->sys_monoraw = ns_to_ktime(raw);
	at_once->sys_realtime = ktime_get_real();
	at_once->device = ns_to_ktime(at_raw(raw));
	return 0;
}

static int set(struct ptp_clock_info *info, const struct timespec64 *time)
{
	go_on(time, 0, rate);
	return 0;
}

static int move(struct ptp_clock_info *info, s64 by_ns)
{
	go_on(NULL, by_ns, rate);
	return 0;
}

static int set_rate(struct ptp_clock_info *info, long scaled_ppm)
{
	go_on(NULL, 0, scaled_ppm);
	return 0;
}

static struct ptp_clock_info about = {
	.owner = THIS_MODULE,
	.name = "hueline",
	.max_adj = 500000,
	.gettime64 = get_basic,
	.settime64 = set,
	.adjtime = move,
	.adjfine = set_rate,
};

static int __init begin(void)
{
	if (comparison > 0)
		about.gettimex64 = get_extended;
	if (comparison > 1)
		about.getcrosststamp = get_precise;
	clock = ptp_clock_register(&about, NULL);
	return IS_ERR_OR_NULL(clock) ? (clock ? PTR_ERR(clock) : -ENODEV) : 0;
}

static void __exit end(void)
{
	ptp_clock_unregister(clock);
}

module_init(begin);
module_exit(end);
MODULE_LICENSE("GPL");
MODULE_DESCRIPTION("A PTP clock that is off the computer's by what a test sets");
