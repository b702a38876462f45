// SPDX-License-Identifier: Apache-2.0 OR GPL-2.0
// A PTP clock of the virtual machine (fetch_modules): CLOCK_MONOTONIC_RAW and an offset, which clock_settime() sets and
// /sys/module/hueline_ptp/parameters/offset_ns tells. `comparison` says which of the kernel's ways of comparing it has: 0 the basic one
// alone, 1 the extended one too, 2 the precise one too. The kernel's core of PTP does everything else.
#include <linux/ktime.h>
#include <linux/module.h>
#include <linux/ptp_clock_kernel.h>

static long offset_ns;
module_param(offset_ns, long, 0444);
static int comparison;
module_param(comparison, int, 0444);

static struct ptp_clock *clock;

static u64 read_ns(void)
{
	return ktime_get_raw_ns() + READ_ONCE(offset_ns);
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
	at_once->device = ns_to_ktime(raw + READ_ONCE(offset_ns));
	return 0;
}

static int set(struct ptp_clock_info *info, const struct timespec64 *time)
{
	WRITE_ONCE(offset_ns, timespec64_to_ns(time) - ktime_get_raw_ns());
	return 0;
}

static int move(struct ptp_clock_info *info, s64 by_ns)
{
	WRITE_ONCE(offset_ns, offset_ns + by_ns);
	return 0;
}

static int refuse_rate(struct ptp_clock_info *info, long scaled_ppm)
{
	return scaled_ppm ? -EOPNOTSUPP : 0;
}

static struct ptp_clock_info about = {
	.owner = THIS_MODULE,
	.name = "hueline",
	.max_adj = 1,
	.gettime64 = get_basic,
	.settime64 = set,
	.adjtime = move,
	.adjfine = refuse_rate,
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
