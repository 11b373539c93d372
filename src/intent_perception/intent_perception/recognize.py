"""Command: `python -m intent_perception.recognize`."""

from intent_perception.recognition.recognize_command import main

if __name__ == "__main__":
    main()
