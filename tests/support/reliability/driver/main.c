/* The command line:
 *
 *     driver JOB PLAN calls SEED COUNT SIZE     COUNT sequences of SIZE actions, from SEED on
 *     driver JOB PLAN states SEED COUNT SIZE    the same, of SIZE damaged states
 *     driver JOB PLAN draws SEED COUNT SIZE     COUNT draws, each advanced by SIZE steps
 *
 * It prints the counts, one "name value" a line, and details of violations to stderr.
 */
#include "driver.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

typedef void Part(Subject *, size_t);

static Part *part(const Job *job, const char *name) {
    if (strcmp(name, "states") == 0) {
        return damaged_states;
    }
    if (strcmp(name, "draws") == 0) {
        return drawn_parameters;
    }
    return job->kind == MODEL_EXCHANGE ? integrated_calls : legal_and_illegal_calls;
}

static void limit_time(double seconds) {
    struct itimerval limit = {{0, 0}, {0, 0}};
    limit.it_value.tv_sec = (time_t)seconds;
    limit.it_value.tv_usec = (suseconds_t)(1e6 * (seconds - (double)limit.it_value.tv_sec));
    setitimer(ITIMER_PROF, &limit, NULL);
}

static void run(const Library *library, const Job *job, const Plan *plan, Counts *counts,
                Part *function, uint64_t seed, size_t size) {
    pid_t child = fork();
    int status = 0;
    if (child == 0) {
        Subject subject;
        limit_time(plan->process_seconds);
        subject_open(&subject, library, job, plan, counts, seed);
        function(&subject, size);
        subject_close(&subject);
        exit(0);
    }
    if (child < 0 || waitpid(child, &status, 0) != child) {
        perror("driver");
        exit(2);
    }
    counts->sequences++;
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGPROF) {
        counts->slow++;
        fprintf(stderr, "slow: seed %llu\n", (unsigned long long)seed);
    } else if (status != 0) {
        counts->crashed++;
        fprintf(stderr, "crashed: seed %llu, status %d\n", (unsigned long long)seed, status);
    }
}

static void print(const Counts *c) {
    static const char *const violations[VIOLATIONS] = {
        "not_finite", "penetrated", "energy_lost", "count_fell", "accepted", "changed", "silent",
        "over_budget",
    };
    static const char *const outcomes[OUTCOMES] = {"ran", "rejected_at_start", "rejected_later",
                                                   "restored", "undone"};
    printf("calls %lu\nillegal %lu\nsequences %lu\nsteps %lu\nevents %lu\n", c->calls, c->illegal,
           c->sequences, c->steps, c->events);
    printf("slow %lu\ncrashed %lu\n", c->slow, c->crashed);
    printf("worst_energy %.3e\nworst_penetration %.3e\nworst_call %.3e\n", c->energy,
           c->penetration, c->call);
    for (int i = 0; i < STATUSES; i++) {
        printf("status_%d %lu\n", i, c->statuses[i]);
    }
    for (int i = 0; i < VIOLATIONS; i++) {
        printf("%s %lu\n", violations[i], c->violations[i]);
    }
    for (int i = 0; i < OUTCOMES; i++) {
        printf("%s %lu\n", outcomes[i], c->outcomes[i]);
    }
}

int main(int count, char **words) {
    Job job;
    Plan plan;
    Library library;
    Counts *counts = mmap(NULL, sizeof *counts, PROT_READ | PROT_WRITE,
                          MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (count != 7 || counts == MAP_FAILED || !job_read(&job, words[1]) ||
        !plan_read(&plan, words[2]) || !library_open(&library, job.library, job.version)) {
        fprintf(stderr, "driver: give a job, a plan, a part, a seed, a count and a size\n");
        return 2;
    }
    uint64_t seed = strtoull(words[4], NULL, 10);
    unsigned long sequences = strtoul(words[5], NULL, 10);
    for (unsigned long i = 0; i < sequences; i++) {
        run(&library, &job, &plan, counts, part(&job, words[3]), seed + i,
            strtoul(words[6], NULL, 10));
    }
    print(counts);
    library_close(&library);
    free(plan.variables);
    job_free(&job);
    return 0;
}
