/* junit.xml of `relit ab`, for a CI system: the form that Ant's JUnit task writes, which is the strictest in
 * use. A testsuite a capture. In it a testcase for each pair, material and threshold (the whole frame is a
 * material too), that fails when a frame is over it; without thresholds a testcase a pair; and one for each
 * frame that could not be compared, an error. */
#ifndef RL_TOOL_AB_JUNIT_H
#define RL_TOOL_AB_JUNIT_H

#include "graph/tool/ab_report.h"

/* Adds the document. The time of a suite is its share of the run's by frames, a testcase's is its share of
 * that: they add up. RL_E_MEMORY. */
rl_code rl_ab_junit(const rl_ab_report *report, rl_str *out, rl_error *err);

#endif
