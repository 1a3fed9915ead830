# cmake -DSOURCE=FOLDER -DFILE=HEADER -P revision.cmake: writes the git revision of SOURCE to HEADER. The header is
# unchanged, so that nothing is compiled again, if the revision is. Without git, or outside of a clone: "no revision".

set(revision "no revision")
find_program(GIT_PROGRAM git)
if(GIT_PROGRAM AND EXISTS ${SOURCE}/.git)
  execute_process(COMMAND ${GIT_PROGRAM} -C ${SOURCE} describe --always --dirty=+ --abbrev=12 --exclude *
                  OUTPUT_VARIABLE described RESULT_VARIABLE code ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(code EQUAL 0)
    set(revision "revision ${described}")
  endif()
endif()
file(CONFIGURE OUTPUT ${FILE} CONTENT "#pragma once

/// The git revision of the source tree; a plus sign marks changes that are not committed.
#define LODESTONE_REVISION \"${revision}\"
")
