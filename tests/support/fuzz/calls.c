/* A target of libFuzzer: the input selects functions of an FMU and their arguments.
 *
 * The environment variable PRBM_JOB is the path of a job file of the importer, which names the FMU.
 */
#include <stdio.h>
#include <stdlib.h>

#include "importer.h"

enum { CALLS = 400 };

int LLVMFuzzerInitialize(int *count, char ***words);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static Job job;
static Library library;

int LLVMFuzzerInitialize(int *count, char ***words) {
    const char *path = getenv("PRBM_JOB");
    (void)count, (void)words;
    if (!path || !job_read(&job, path) || !library_open(&library, job.library, job.version)) {
        fprintf(stderr, "calls: set PRBM_JOB to the path of a valid job file\n");
        exit(2);
    }
    return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    Source source = {data, size, 0, 0};
    arbitrary_calls(&library, &job, &source, CALLS);
    return 0;
}
