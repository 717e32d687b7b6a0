# The pages of the manual and the completion of shells, as the program prints them.
# PROGRAM: relief; FOLDER: what becomes share/.
function(write_output file)
  execute_process(COMMAND "${PROGRAM}" ${ARGN} OUTPUT_FILE "${FOLDER}/${file}" COMMAND_ERROR_IS_FATAL ANY)
endfunction()

foreach(folder man/man1 bash-completion/completions zsh/site-functions fish/vendor_completions.d)
  file(MAKE_DIRECTORY "${FOLDER}/${folder}")
endforeach()
write_output(bash-completion/completions/relief completion bash)
write_output(zsh/site-functions/_relief completion zsh)
write_output(fish/vendor_completions.d/relief.fish completion fish)

write_output(man/man1/relief.1 help --man)
execute_process(COMMAND "${PROGRAM}" help --json OUTPUT_VARIABLE all COMMAND_ERROR_IS_FATAL ANY)
string(JSON count LENGTH "${all}" commands)
math(EXPR last "${count} - 1")
foreach(k RANGE ${last})
  string(JSON command GET "${all}" commands ${k} command)
  write_output(man/man1/relief-${command}.1 help ${command} --man)
endforeach()
